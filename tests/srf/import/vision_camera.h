// A camera as computer vision writes it (x right, y down, z forwards, x_camera = R X + t), and its projection
// straight from OpenCV's equations: what imported cameras are held against.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"

#include <random>
#include <string>

namespace surflect {

struct VisionCamera {
  Eigen::Quaterniond rotation;
  Vec3<double> translation;
  double fx = 0, fy = 0, cx = 0, cy = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  int width = 0, height = 0;

  Vec2<double> project(const Vec3<double>& world) const {
    const Vec3<double> p = rotation * world + translation;
    const double x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
    const double radial = 1 + k1 * r2 + k2 * r2 * r2;
    return {fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
            fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy};
  }
};

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
      camera.k1 = uniform(-0.1, 0.1), camera.k2 = uniform(-0.05, 0.05), camera.p1 = uniform(-0.01, 0.01),
      camera.p2 = uniform(-0.01, 0.01);
    return camera;
  }

  // That both put random points within a unit cube onto the same pixels, those of `wanted` moved by `shift`.
  void expectSamePixels(const Camera<AcquisitionSpace>& found, const VisionCamera& wanted, double shift = 0) {
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
  writePng(path, randomImage(width, height, 3, 0, 1, seed));
}

// A number with all its digits.
inline std::string digits(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}
template <class... Numbers> std::string row(Numbers... numbers) {
  std::string text;
  (text.append(text.empty() ? "" : " ").append(digits(numbers)), ...);
  return text;
}

// The view of a name; a failure if there is none.
inline const View& viewNamed(const Capture& capture, const std::string& name) {
  for (const View& view : capture.views)
    if (view.identity == name) return view;
  throw Error("no view " + name);
}

} // namespace surflect
