#include "render/splat_kernel_loops.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect {
namespace {

TEST(SplatKernelLoops, TheGaussianIsWithin4e6OfItselfUpToTheCutOff) {
  double worst = 0;
  for (int i = 0; i <= 20'000; ++i) {
    const float q = kCutoff * kCutoff * static_cast<float>(i) / 20'000;
    float got[kLanes];
    store(got, gaussian(broadcast(q)));
    worst = std::max(worst, std::abs(got[0] / std::exp(-0.5 * double{q}) - 1));
  }
  EXPECT_LT(worst, 4e-6);
}

} // namespace
} // namespace surflect
