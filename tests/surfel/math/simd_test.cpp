#include "surfel/math/simd.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(Simd, TheBestIsUsedUnlessAnotherIsChosen) {
  const std::vector<Simd> all = supportedSimd();
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.front(), Simd::scalar);
  EXPECT_EQ(all.back(), bestSimd());
  useSimd(Simd::scalar);
  EXPECT_EQ(bestSimd(), Simd::scalar);
  EXPECT_EQ(supportedSimd(), all);
  useSimd(all.back());
  EXPECT_TRUE(std::ranges::is_sorted(all));
}

TEST(Simd, IsCalledAsTheCommandLineSays) {
  EXPECT_EQ(nameOf(Simd::scalar), "scalar");
  EXPECT_EQ(nameOf(Simd::avx2), "avx2");
  EXPECT_EQ(nameOf(Simd::avx512), "avx512");
}

} // namespace
} // namespace surflect
