#include "bench/accuracy/directions.h"

#include "render/evaluation/measure.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/frame.h"
#include "srf/image/mask.h"
#include "tests/support/random.h"
#include "tests/support/synthetic_capture.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <random>

namespace surflect::bench {
namespace {

constexpr std::array<DirectionsBack, 4> all{byPolarFactor, byBisector, byGramSchmidt, byInverseJacobian};

Mat3<double> randomJacobian(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Mat3<double> j;
  do j = Mat3<double>::NullaryExpr([&] { return normal(random); });
  while (std::abs(j.determinant()) < 0.1);
  return j;
}

Mat3<double> normalisedColumns(Mat3<double> m) {
  m.colwise().normalize();
  return m;
}

TEST(Directions, UnderARigidWarpAllAreItsInverse) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> turn = randomRotation(random), rest = randomRotation(random);
    for (const auto& back : all) EXPECT_LT((*back({rest, turn * rest}) - turn.transpose()).norm(), 1e-14);
  }
}

// The warp is conformal: a rotation, a mirroring and a uniform scale.
TEST(Directions, UnderAConformalWarpAllAreItsInverseButForLength) {
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    const double mirror = i % 2 == 0 ? 1 : -1;
    const Mat3<double> turn = randomRotation(random) * Vec3<double>(1, mirror, 1).asDiagonal();
    const double scale = std::exp2(i % 7 - 3);
    const Mat3<double> rest = randomRotation(random);
    for (const auto& back : all)
      EXPECT_LT((normalisedColumns(*back({rest, scale * turn * rest})) - turn.transpose()).norm(), 1e-14);
  }
}

TEST(Directions, GramSchmidtKeepsU) {
  std::mt19937 random(3);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> rest = randomRotation(random), warped = randomJacobian(random) * rest;
    const Mat3<double> back = *byGramSchmidt({rest, warped});
    EXPECT_LT((back * warped.col(0).normalized() - rest.col(0)).norm(), 1e-13);
    EXPECT_LT((back * back.transpose() - Mat3<double>::Identity()).norm(), 1e-13);
  }
}

TEST(Directions, AllThatAreOrthogonalBringTheNormalBack) {
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> rest = randomRotation(random), warped = randomJacobian(random) * rest;
    const double side = warped.determinant() < 0 ? -1 : 1;
    const Vec3<double> normal = side * warped.col(0).cross(warped.col(1)).normalized();
    for (const auto& back : {byPolarFactor, byBisector, byGramSchmidt})
      EXPECT_LT((*back({rest, warped}) * normal - rest.col(2)).norm(), 1e-12);
  }
}

TEST(Directions, InverseJacobianBringsTheWarpedTangentsBack) {
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> rest = randomRotation(random), warped = randomJacobian(random) * rest;
    EXPECT_LT((*byInverseJacobian({rest, warped}) * warped - rest).norm(), 1e-12);
  }
}

TEST(Directions, ParallelTangentsHaveNone) {
  Mat3<double> warped = Mat3<double>::Identity();
  warped.col(1) = 2 * warped.col(0);
  for (const auto& back : all) EXPECT_FALSE(back({Mat3<double>::Identity(), warped}));
}

// Under a low light, so that the warped sphere has shadow states under kriging.
void expectTheMapIsTheProgramsOwn(const model::Model& model, DirectionsBack back,
                                  const surfels::FrameOptions& options) {
  surfels::FrameWorkspace workspace(model, size_t{1} << 28);
  const auto warp = warp::scaleWarp({1.2, 0.8, 1}, {0, 0, 0});
  const auto camera = studio::cameraFrom<ObjectSpace>({0.3, 0.5, 1}, 40);
  const std::vector<scene::ShotLight> lights{scene::ShotDirectionalLight{
      assume<Direction3<ObjectSpace, double>>(Vec3<double>(0.8, 0, -0.6)), {3, 3, 3}}};
  const image::Image own = surfels::renderFrame(model, {*warp, camera, lights}, options, workspace).color;
  const auto rmsBy = [&](DirectionsBack other) {
    const image::Image color = withDirections(model, other)->render({*warp, camera, lights}).color;
    return std::sqrt(evaluation::squaredError(own, color, image::objectMask(own)).mean());
  };
  EXPECT_LT(rmsBy(back), 1e-6);
  EXPECT_GT(rmsBy(byInverseJacobian), 1e-3);
}

TEST(Directions, FramesByThePolarFactorAreTheProgramsOwn) {
  studio::PackedStudio packed({}, 1500);
  expectTheMapIsTheProgramsOwn(packed.model, byPolarFactor, {});
  packed.model.interpolation = {.kind = weights::Interpolation::kriging, .shadows = true};
  ASSERT_TRUE(surfels::castsShadows(packed.model, {}));
  expectTheMapIsTheProgramsOwn(packed.model, byPolarFactor, {});
}

TEST(Directions, FramesByTheBisectorAreThoseOfTheOptionOfThatName) {
  const studio::PackedStudio packed({}, 1500);
  expectTheMapIsTheProgramsOwn(packed.model, byBisector, {.tangents = surfels::Tangents::bisector});
}

} // namespace
} // namespace surflect::bench
