// Random cameras in computer vision's axes, and comparison with imported ones.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"
#include "tests/support/vision_camera.h"

#include <random>
#include <string>

namespace surflect::importers {

class VisionRig {
public:
  explicit VisionRig(unsigned seed) : random_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vec3<double> point() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  // Looks at a point near the origin from about 5 away, turned any way round.
  VisionCamera camera(bool distorts) {
    VisionCamera camera;
    camera.rotation = Eigen::Quaterniond(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    camera.rotation.normalize();
    camera.translation = {uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(4.5, 5.5)};
    camera.width = 16, camera.height = 12;
    camera.fx = uniform(18, 22), camera.fy = uniform(18, 22);
    camera.cx = uniform(7, 9), camera.cy = uniform(5, 7);
    if (distorts)
      camera.k1 = uniform(-0.1, 0.1), camera.k2 = uniform(-0.05, 0.05), camera.k3 = uniform(-0.02, 0.02),
      camera.p1 = uniform(-0.01, 0.01), camera.p2 = uniform(-0.01, 0.01);
    return camera;
  }

  // Expects both cameras to project random points of a unit cube onto the same pixels, those of `wanted`
  // moved by `shift`.
  void expectSamePixels(const capture::Camera<AcquisitionSpace>& found, const VisionCamera& wanted,
                        double shift = 0) {
    EXPECT_EQ(found.lens.width, wanted.width);
    EXPECT_EQ(found.lens.height, wanted.height);
    for (int i = 0; i < 20; ++i) {
      const Vec3<double> world = point();
      const auto pixel = found.project(assume<Point3<AcquisitionSpace, double>>(world));
      ASSERT_TRUE(pixel);
      const Vec2<double> expected = wanted.project(world);
      EXPECT_NEAR(pixel->x, expected[0] + shift, 1e-9);
      EXPECT_NEAR(pixel->y, expected[1] + shift, 1e-9);
    }
  }

private:
  std::mt19937 random_;
};

inline void writePicture(const std::filesystem::path& path, int width = 16, int height = 12,
                         unsigned seed = 1) {
  std::filesystem::create_directories(path.parent_path());
  image::writePng(path, image::randomImage(width, height, 3, 0, 1, seed));
}

// The view of a name; a failure if there is none.
inline const capture::View& viewNamed(const capture::Capture& capture, const std::string& name) {
  for (const capture::View& view : capture.views)
    if (view.identity == name) return view;
  throw Error("no view " + name);
}

} // namespace surflect::importers
