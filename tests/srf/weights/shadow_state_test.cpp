#include "srf/weights/shadow_state.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect::weights {
namespace {

constexpr float kSpacing = 0.05f;

// A floor of 4 x 4 at z = 0, and a roof of 1 x 1 above its middle at z = 1.
SurfelCloud floorAndRoof() {
  SurfelCloud cloud;
  const auto add = [&](float x, float y, float z, bool isLower) {
    cloud.p0.push_back({x, y, z});
    cloud.r0.push_back({0, 0, static_cast<float>(isLower)});
    cloud.radius.push_back(kSpacing);
    cloud.coverage.push_back(0.44f); // Gaussians add up to 1
  };
  for (float y = -2; y < 2; y += kSpacing)
    for (float x = -2; x < 2; x += kSpacing) add(x, y, 0, false);
  for (float y = -0.5f; y < 0.5f; y += kSpacing)
    for (float x = -0.5f; x < 0.5f; x += kSpacing) add(x, y, 1, false);
  return cloud;
}

Occluders allOf(const SurfelCloud& cloud) {
  Occluders occluders;
  for (uint32_t i = 0; i < cloud.size(); ++i)
    occluders.surfels.push_back(i), occluders.splats.push_back({cloud.radius[i], cloud.coverage[i]});
  occluders.clearance = kSpacing;
  return occluders;
}

capture::Light directional(double x, double z) {
  capture::Light light;
  light.kind =
      capture::DirectionalLight{normalized(Direction3<AcquisitionSpace, double>(x, 0, z)), {1, 1, 1}};
  return light;
}

capture::Light pointAt(double x, double z) {
  capture::Light light;
  light.kind = capture::PointLight{Point3<AcquisitionSpace, double>(x, 0, z), {1, 1, 1}};
  return light;
}

// Where a light above throws the roof's edge at x = 0.5 on the floor.
TEST(LightVisibility, TheEdgeOfACastShadowIsWhereRaysSay) {
  const SurfelCloud cloud = floorAndRoof();
  const std::vector lights{directional(0, 1), directional(1, 1), pointAt(0, 3), directional(0, -1)};
  const VisibilityWeights reached = shadowStates(cloud, allOf(cloud), lights);
  const double reach = visibilityRadius(cloud) + 2 * kSpacing;
  const auto expect = [&](size_t light, double low, double high) { // shadow from x = low to high at y = 0
    for (size_t i = 0; i < cloud.size(); ++i) {
      const double x = cloud.p0[i].x(), y = cloud.p0[i].y();
      if (cloud.p0[i].z() != 0 || std::abs(y) > 0.2) continue;
      const float state = VisibilityWeights::decode(reached.of(i)[light]);
      if (x > low + reach && x < high - reach) {
        EXPECT_LT(state, 0.01f) << "light " << light << " at " << x;
      }
      if (x < low - reach || x > high + reach) {
        EXPECT_GT(state, 0.95f) << "light " << light << " at " << x;
      }
    }
  };
  expect(0, -0.5, 0.5);
  expect(1, -1.5, -0.5);
  expect(2, -0.75, 0.75);
  for (size_t i = 0; i < cloud.size(); ++i) EXPECT_EQ(reached.of(i)[3], 0); // attached shadow
}

TEST(LightVisibility, OfNoLightsIsEmpty) {
  const SurfelCloud cloud = floorAndRoof();
  EXPECT_TRUE(shadowStates(cloud, allOf(cloud), {}).values.empty());
}

} // namespace
} // namespace surflect::weights
