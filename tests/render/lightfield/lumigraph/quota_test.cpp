#include "render/lightfield/lumigraph/quota.h"

namespace surflect::lumigraph {
namespace {

// [Azuma 1999, §4.1]
TEST(Quota, OfThePapersSurfaceLightFieldIsATwelfth) {
  EXPECT_EQ(slabQuota(33235488, 2), 2769624u);
  EXPECT_EQ(33235488u / 12, 2769624u);
}

TEST(Quota, WithoutRedundancyIsASixth) { EXPECT_EQ(slabQuota(6 * 1234 + 5, 1), 1234u); }

} // namespace
} // namespace surflect::lumigraph
