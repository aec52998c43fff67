#include "render/splat_kernel_loops.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect {
namespace {

TEST(SplatKernelLoops, TheColorWeightIsWithin8e6OfItselfUpToTheCutOff) {
  double worst = 0;
  for (int i = 0; i <= 20'000; ++i) {
    const float t = static_cast<float>(i) / 20'000;
    float got[kLanes];
    store(got, colorWeight(broadcast(t)));
    worst =
        std::max(worst, std::abs(got[0] / std::exp(-kCutoffSigmas * kCutoffSigmas * (1 - double{t})) - 1));
  }
  EXPECT_LT(worst, 8e-6);
}

} // namespace
} // namespace surflect
