// Films of the synthetic sphere, for tests that compare them.
#pragma once

#include "render/surfels/frame.h"
#include "srf/image/mask.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace surflect::studio {

inline constexpr int pictureSize = 40; // pixels

inline method::FrameLayers filmOf(const model::Model& model, const warp::Warp& warp,
                                  const capture::Camera<ObjectSpace>& camera,
                                  const std::vector<scene::ShotLight>& lights,
                                  const surfels::FrameOptions& options = {}) {
  surfels::FrameWorkspace workspace(model, size_t{1} << 28);
  return surfels::renderFrame(model, {warp, camera, lights}, options, workspace);
}

inline warp::WarpPointer noWarp() { return warp::chainWarp({}); }

inline double largestDifference(const image::Image& a, const image::Image& b) {
  EXPECT_EQ(a.values.size(), b.values.size());
  double largest = 0;
  for (size_t i = 0; i < a.values.size(); ++i)
    largest = std::max(largest, double{std::abs(a.values[i] - b.values[i])});
  return largest;
}

// Away from the outline, where splats and truth filter differently.
inline image::Mask interiorOf(const SphereView& view) {
  return image::eroded(image::objectMask(view.alpha), 2);
}

// The white furnace: light of radiance 1 from everywhere gives a Lambert sphere the colour of its albedo.
// The bound is what 80 captured lights leave of it.
inline void expectAlbedo(const image::Image& film, const capture::Camera<ObjectSpace>& camera, Rgb albedo) {
  const image::Mask interior = interiorOf(viewSphere(camera, 1));
  const std::array expected{albedo.r, albedo.g, albedo.b};
  size_t pixels = 0;
  for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel) {
    if (!interior.inside[pixel]) continue;
    ++pixels;
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(film.values[4 * pixel + c] / expected[c], 1, 0.0075);
  }
  EXPECT_GE(pixels, 300u);
}

// About an axis through the origin, then along a vector.
struct RigidMotion {
  Vec3<double> axis;
  Angle angle;
  Vec3<double> translation;

  Rigid<ObjectSpace, ObjectSpace> rigid() const {
    return {Eigen::AngleAxisd(angle.radians(), axis).toRotationMatrix(), translation};
  }
  warp::WarpPointer warp() const { return warp::rigidWarp(axis, angle, Vec3<double>::Zero(), translation); }
  capture::Camera<ObjectSpace> operator()(capture::Camera<ObjectSpace> camera) const {
    camera.cameraFromWorld = camera.cameraFromWorld * rigid().inverse();
    return camera;
  }
};

inline RigidMotion randomMotion(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return {Vec3<double>(x, y, z).normalized(), Angle::fromRadians(3 * uniform(random)), {2 * y, z, 3 * x}};
}

// The world with x turned into -x: the camera that stands in it as another does here, and its picture.
inline const Mat3<double> mirror = Vec3<double>(-1, 1, 1).asDiagonal();

inline capture::Camera<ObjectSpace> mirrored(capture::Camera<ObjectSpace> camera) {
  const auto& pose = camera.cameraFromWorld;
  camera.cameraFromWorld = {mirror * pose.rotation() * mirror, mirror * pose.translation()};
  return camera;
}

inline image::Image flipped(const image::Image& image) {
  image::Image result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::ranges::copy(image.at(image.width - 1 - x, y), result.at(x, y).begin());
  return result;
}

// The sphere is photographed and packed once for all tests of a suite.
template <size_t surfels> class PackedSphere : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    packed = std::make_unique<PackedStudio>(Studio{.size = pictureSize}, surfels);
  }
  static void TearDownTestSuite() { packed.reset(); }
  static const model::Model& model() { return packed->model; }

  const capture::Camera<ObjectSpace> camera = cameraFrom<ObjectSpace>({0.3, 0.5, 1}, pictureSize);

private:
  static inline std::unique_ptr<PackedStudio> packed;
};

} // namespace surflect::studio
