#include "srf/shading/light_weights.h"

#include <gtest/gtest.h>

namespace surflect::shading {
namespace {

capture::Light lamp(Rgb irradiance) {
  return {"L", "L", capture::DirectionalLight{Direction3<AcquisitionSpace, double>(0, 0, 1), irradiance}};
}
capture::Light bulb(Rgb intensity) {
  return {"P", "P", capture::PointLight{Point3<AcquisitionSpace, double>(1, 2, 3), intensity}};
}

TEST(CapturedLights, ColourAndStrengthOfLampsOfOneColourAreTheRatio) {
  const Rgb color{0.3f, 1.7f, 0.9f}, now{2, 3, 5};
  const std::vector<capture::Light> lights{lamp(color), bulb(3 * color), lamp(0.1f * color)};
  CapturedLights rig(lights);
  rig.moveTo(Point3<AcquisitionSpace, double>(0.5, -1, 0.25));
  rig.evaluateAll();
  ASSERT_TRUE(rig.inverseColor());
  for (size_t light = 0; light < lights.size(); ++light) {
    const Eigen::Array4f ratio = rig.ratio({1, now.r, now.g, now.b}, light);
    const Rgb made = rig.inverseStrength(light) * (*rig.inverseColor() * now);
    EXPECT_NEAR(made.r / ratio[1], 1, 5e-7);
    EXPECT_NEAR(made.g / ratio[2], 1, 5e-7);
    EXPECT_NEAR(made.b / ratio[3], 1, 5e-7);
  }
}

TEST(CapturedLights, WhiteLampsOfAnyStrengthHaveTheRatioItself) {
  const std::vector<capture::Light> lights{lamp({0.7f, 0.7f, 0.7f}), lamp({3, 3, 3})};
  const CapturedLights rig(lights);
  ASSERT_TRUE(rig.inverseColor());
  EXPECT_EQ(*rig.inverseColor(), (Rgb{1, 1, 1}));
  for (size_t light = 0; light < lights.size(); ++light)
    EXPECT_EQ(rig.inverseStrength(light), rig.ratio({1, 1, 1, 1}, light)[2]);
}

TEST(CapturedLights, LampsOfSeveralColoursHaveNoneInCommon) {
  EXPECT_FALSE(sharedColor(std::vector{lamp({1, 1, 1}), lamp({1, 1, 1.00001f})}).inverse);
  EXPECT_FALSE(sharedColor(std::vector{lamp({1, 2, 3}), bulb({3, 2, 1})}).inverse);
  EXPECT_FALSE(sharedColor({}).inverse);
}

} // namespace
} // namespace surflect::shading
