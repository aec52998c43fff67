#include "render/lanes_scalar.h"

#include "render/splat_kernel_loops.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect {
namespace {

TEST(Lanes, TheGaussianIsWithin4e6OfItselfUpToTheCutOff) {
  double worst = 0;
  for (int i = 0; i <= 20'000; ++i) {
    const float q = kCutoff * kCutoff * static_cast<float>(i) / 20'000;
    float got[kLanes];
    store(got, gaussian(broadcast(q)));
    worst = std::max(worst, std::abs(got[0] / std::exp(-0.5 * double{q}) - 1));
  }
  EXPECT_LT(worst, 4e-6);
}

TEST(Lanes, CompressingKeepsThoseOfTheMaskInOrder) {
  float in[16], out[16] = {};
  for (int i = 0; i < 16; ++i) in[i] = static_cast<float>(i * 7 % 16);
  storeCompressed(out, load(in) < broadcast(5), load(in));
  const float expected[] = {0, 3, 1, 4, 2};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(out[i], expected[i]);
}

} // namespace
} // namespace surflect
