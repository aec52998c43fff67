#include "srf/capture/rig.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::capture {
namespace {

using P = Point3<AcquisitionSpace, double>;
using D = Direction3<AcquisitionSpace, double>;

class Rig : public ::testing::Test {
protected:
  double coordinate() { return std::uniform_real_distribution<double>(-3, 3)(random_); }
  P point() { return {coordinate(), coordinate(), coordinate()}; }

  std::mt19937 random_{1};
};

TEST_F(Rig, ADirectionalLightIsTheSameEverywhere) {
  const Light light{"L0", "L0", DirectionalLight{{0, 0.6, 0.8}, {1, 2, 3}}};
  for (int i = 0; i < 50; ++i) {
    const P p = point();
    EXPECT_EQ(towardsLight(light, p), D(0, 0.6, 0.8));
    EXPECT_EQ(irradianceAt(light, p), (Rgb{1, 2, 3}));
  }
}

// To first order what any lamp does that is not far.
TEST_F(Rig, AnUnevenLightRisesByItsGradient) {
  for (int i = 0; i < 50; ++i) {
    const Vec3<double> gradient = 0.1 * point().raw();
    const Light light{"L0", "L0", DirectionalLight{{0, 0.6, 0.8}, {1, 2, 3}, gradient}};
    EXPECT_EQ(irradianceAt(light, {0, 0, 0}), (Rgb{1, 2, 3}));
    const P p = point(), q = point();
    const double ratio = std::exp(gradient.dot((q - p).raw()));
    EXPECT_NEAR(irradianceAt(light, q).g / irradianceAt(light, p).g, ratio, 2e-7 * ratio);
    EXPECT_EQ(towardsLight(light, p), D(0, 0.6, 0.8));
  }
}

TEST_F(Rig, NoUnevenLightGoesOut) {
  const Light light{"L0", "L0", DirectionalLight{{0, 0, 1}, {1, 1, 1}, {1e12, 0, 0}}};
  EXPECT_FLOAT_EQ(irradianceAt(light, {1e12, 0, 0}).g, 20.085537f);
  EXPECT_FLOAT_EQ(irradianceAt(light, {-1e12, 0, 0}).g, 0.049787068f);
}

TEST_F(Rig, APointLightIsReachedAlongItsDirectionAndFallsWithTheSquareOfDistance) {
  for (int i = 0; i < 50; ++i) {
    const P position = point(), p = point();
    const Light light{"P0", "P0", PointLight{position, {1, 2, 4}}};
    const D towards = towardsLight(light, p);
    const double distance = length(position - p);
    EXPECT_NEAR(length(towards), 1, 1e-15);
    EXPECT_NEAR(length(p + distance * towards - position), 0, 1e-14);
    const Rgb near = irradianceAt(light, p), far = irradianceAt(light, position + -2 * distance * towards);
    EXPECT_NEAR(near.g * distance * distance, 2, 1e-6);
    EXPECT_NEAR(near.r / far.r, 4, 2e-6);
    EXPECT_NEAR(near.b / far.b, 4, 2e-6);
  }
}

} // namespace
} // namespace surflect::capture
