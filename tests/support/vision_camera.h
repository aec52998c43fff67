// A camera in computer vision's axes (x right, y down, z forwards, x_camera = R X + t), with projection by
// OpenCV's equations: the reference for imported cameras.
#pragma once

#include "srf/capture/camera.h"

#include <cstdio>
#include <string>

namespace surflect {

struct VisionCamera {
  Eigen::Quaterniond rotation;
  Vec3<double> translation;
  double fx = 0, fy = 0, cx = 0, cy = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  int width = 0, height = 0;
  double k3 = 0;

  Vec2<double> project(const Vec3<double>& world) const {
    const Vec3<double> p = rotation * world + translation;
    const double x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
    const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
    return {fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
            fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy};
  }
};

// Conversion from our camera, whose y and z axes are negated.
inline VisionCamera visionCameraOf(const capture::Camera<AcquisitionSpace>& camera) {
  const Vec3<double> axes(1, -1, -1);
  const capture::Lens& lens = camera.lens;
  return {Eigen::Quaterniond(Mat3<double>(axes.asDiagonal() * camera.cameraFromWorld.rotation())),
          axes.asDiagonal() * camera.cameraFromWorld.translation(),
          lens.focalX,
          lens.focalY,
          lens.centerX,
          lens.centerY,
          lens.k1,
          lens.k2,
          lens.p1,
          lens.p2,
          lens.width,
          lens.height,
          lens.k3};
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

} // namespace surflect
