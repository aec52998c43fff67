#include "render/gaussians/gaussians.h"

#include "render/gaussians/gaussian_ply.h"
#include "srf/image/color.h"
#include "surfel/base/file.h"
#include "surfel/geometry/ply.h"
#include "tests/render/films.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

namespace surflect::gaussians {
namespace {

Mat3<double> rotationOf(const Shape& shape) {
  return Eigen::Quaterniond(shape.rotation[0], shape.rotation[1], shape.rotation[2], shape.rotation[3])
      .toRotationMatrix();
}

// R diag(scale)^2 R^T
Mat3<double> covarianceOf(const Shape& shape) {
  const Vec3<double> scale(shape.scale[0], shape.scale[1], shape.scale[2]);
  const Mat3<double> axes = rotationOf(shape) * scale.asDiagonal();
  return axes * axes.transpose();
}

Shape shapeOf(const Vec3<double>& u, const Vec3<double>& v, Handedness handedness, float radius) {
  return gaussians::shapeOf({1, 2, 3}, assume<Direction3<ObjectSpace>>(u), assume<Direction3<ObjectSpace>>(v),
                            handedness, radius);
}

// The covariance of the points a u + b v is s^2 (u u^T + v v^T), whatever axes it is written in; beside it is
// the thickness alone.
TEST(GaussianShape, HasTheCovarianceOfTheShearedEllipse) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3<double> u = randomUnit(random), v = 3 * randomUnit(random);
    const float radius = 0.25f;
    const Shape shape = shapeOf(u, v, Handedness::kept, radius);
    const Vec3<double> normal = u.cross(v).normalized();
    const double deviation = kDeviationPerRadius * radius;
    const Mat3<double> flat = deviation * deviation * (u * u.transpose() + v * v.transpose());
    const Mat3<double> thick = std::pow(kThickness * shape.scale[1], 2) * (normal * normal.transpose());
    EXPECT_LT((covarianceOf(shape) - flat - thick).norm(), 4e-7 * flat.norm());
    EXPECT_GT(shape.normal.cast<double>().dot(normal), 1 - 1e-6);
    EXPECT_GE(shape.rotation[0], 0);
    EXPECT_GE(shape.scale[0], shape.scale[1]);
  }
}

TEST(GaussianShape, OfAMirroredSurfelPointsOutwards) {
  const Vec3<double> u(1, 0, 0), v(0, 2, 0);
  EXPECT_GT(shapeOf(u, v, Handedness::kept, 1).normal[2], 0.999f);
  const Shape mirrored = shapeOf(u, v, Handedness::mirrored, 1);
  EXPECT_LT(mirrored.normal[2], -0.999f);
  EXPECT_GT((rotationOf(mirrored) * Vec3<double>::UnitZ()).dot(mirrored.normal.cast<double>()), 0.999);
}

TEST(GaussianPly, FieldsGiveBackScaleOpacityAndColour) {
  Shape shape;
  shape.center = {1, 2, 3};
  shape.scale = {0.5f, 0.25f, 0.01f};
  Look look;
  look.color[0] = {0.25 / kConstantHarmonic, 0.5 / kConstantHarmonic, 1 / kConstantHarmonic};
  for (size_t j = 1; j < kMostCoefficients; ++j) look.color[j] = {1.0 * j, 100.0 + j, 200.0 + j};
  look.opacity = 0.75f;
  for (int degree = 0; degree <= kHighestDegree; ++degree) {
    const std::vector<std::string> fields = plyFields(degree);
    const std::vector<float> values = plyValues(shape, look, degree);
    ASSERT_EQ(values.size(), fields.size());
    const auto at = [&](const std::string& field) {
      return double{values[static_cast<size_t>(std::ranges::find(fields, field) - fields.begin())]};
    };
    EXPECT_EQ(at("z"), 3);
    EXPECT_NEAR(0.5 + kConstantHarmonic * at("f_dc_0"), 0.25, 1e-7);
    EXPECT_EQ(at("f_dc_1"), 0);
    EXPECT_NEAR(0.5 + kConstantHarmonic * at("f_dc_2"), 1, 1e-7);
    EXPECT_NEAR(1 / (1 + std::exp(-at("opacity"))), 0.75, 1e-7);
    EXPECT_NEAR(std::exp(at("scale_1")), 0.25, 1e-7);
    EXPECT_EQ(at("rot_0"), 1);
    if (degree == 0) continue;
    const size_t perChannel = coefficientsOf(degree) - 1; // all of red come first
    EXPECT_EQ(at("f_rest_0"), 1);
    EXPECT_EQ(at("f_rest_" + std::to_string(perChannel)), 101);
    EXPECT_EQ(at("f_rest_" + std::to_string(3 * perChannel - 1)), 200.0 + static_cast<double>(perChannel));
  }
}

TEST(GaussianPly, ValuesAreFiniteForNoOpacityAndNoWidth) {
  Look look;
  look.opacity = 0;
  for (const float value : plyValues({}, look, 3)) EXPECT_TRUE(std::isfinite(value));
  look.opacity = 1;
  for (const float value : plyValues({}, look, 3)) EXPECT_TRUE(std::isfinite(value));
}

class GaussiansOfSphere : public studio::PackedSphere<1500> {
protected:
  surfels::OutgoingRadiance radianceUnder(const warp::Warp& warp,
                                          const std::vector<scene::ShotLight>& lights) {
    return {model(), drawn, {warp, camera, lights}, options, workspace};
  }

  const std::vector<scene::ShotLight> lamp{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
  const surfels::FrameOptions options;
  const surfels::DrawnSurfels drawn = surfels::drawnSurfels(model(), model().cloud.size());
  surfels::FrameWorkspace workspace{model(), size_t{1} << 26};
};

// A Lambert sphere looks the same from everywhere: its harmonics are the sRGB curve of A / pi E, but for what
// its photographs and the blend of lights leave.
TEST_F(GaussiansOfSphere, ALambertSphereHasTheColourOfItsClosedForm) {
  const auto still = studio::noWarp();
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp);
  const Gaussians gaussians(radiance);
  ASSERT_EQ(gaussians.size(), model().cloud.size());
  const std::vector<Look> looks = gaussians.looks(0, gaussians.size(), {3, 0.5});
  double squared = 0, largestRest = 0;
  size_t lit = 0;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    const Vec3<double> n = gaussians.shape(i).center.cast<double>();
    const Vec3<double> toLight = Vec3<double>(2, 1, 2) - n;
    const double cosine = n.dot(toLight.normalized());
    if (cosine < 0.3) continue;
    ++lit;
    const double red = studio::Studio{}.albedo.r / std::numbers::pi * 9 * cosine / toLight.squaredNorm();
    const double error =
        kConstantHarmonic * looks[i].color[0][0] - double{image::srgbFromLinear(static_cast<float>(red / 2))};
    squared += error * error;
    for (size_t j = 1; j < kMostCoefficients; ++j)
      largestRest = std::max(largestRest, std::abs(looks[i].color[j][0]));
    EXPECT_EQ(looks[i].opacity, static_cast<float>(kOpacity));
  }
  EXPECT_GT(lit, 300u);
  EXPECT_LT(std::sqrt(squared / static_cast<double>(lit)), 0.006);
  EXPECT_LT(largestRest, 0.06);
}

TEST_F(GaussiansOfSphere, HaveTheSameLooksInPartsAndAtOnce) {
  const auto twist = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(50), {0, 0, 0});
  const surfels::OutgoingRadiance radiance = radianceUnder(*twist, lamp);
  const Gaussians gaussians(radiance);
  const std::vector<Look> whole = gaussians.looks(0, 200, {1, 1}), part = gaussians.looks(150, 200, {1, 1});
  for (size_t i = 0; i < part.size(); ++i) {
    EXPECT_EQ(part[i].color, whole[150 + i].color);
    EXPECT_EQ(part[i].opacity, whole[150 + i].opacity);
  }
}

TEST_F(GaussiansOfSphere, AFileHasTheBytesThatWereStatedAndOurReaderFindsItsValues) {
  const auto still = studio::noWarp();
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp);
  const Gaussians gaussians(radiance);
  const auto path = std::filesystem::path(::testing::TempDir()) / "gaussians.ply";
  const LookOptions options{2, 1};
  writeGaussianPly(path, gaussians, options, "a comment");
  EXPECT_EQ(std::filesystem::file_size(path), plyBytes(gaussians.size(), 2, "a comment"));
  const PlyFile file = readPly(path);
  const PlyElement* vertices = file.find("vertex");
  ASSERT_TRUE(vertices);
  ASSERT_EQ(vertices->count, gaussians.size());
  const std::vector<Look> looks = gaussians.looks(0, gaussians.size(), options);
  const std::vector<std::string> fields = plyFields(2);
  for (const size_t i : {size_t{0}, gaussians.size() - 1}) {
    const std::vector<float> values = plyValues(gaussians.shape(i), looks[i], 2);
    for (size_t field = 0; field < fields.size(); ++field)
      EXPECT_EQ(vertices->scalars(fields[field])[i], values[field]) << fields[field];
  }
}

TEST_F(GaussiansOfSphere, AnInterruptionLeavesNoFile) {
  const auto still = studio::noWarp();
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp);
  const Gaussians gaussians(radiance);
  const auto path = std::filesystem::path(::testing::TempDir()) / "interrupted.ply";
  int asked = 0;
  Progress progress;
  progress.cancelled = [&] { return ++asked > 20; };
  EXPECT_THROW(writeGaussianPly(path, gaussians, {3, 1}, "", progress), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(path));
}

} // namespace
} // namespace surflect::gaussians
