// Clouds for the tests of this folder.
#pragma once

#include "render/splat/splat.h"
#include "surfel/sampling.h"

#include <functional>
#include <numbers>
#include <random>

namespace surflect::testing {

using Rng = std::mt19937;

inline double uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

// Each coordinate within [-reach, reach].
inline Vec3<double> randomVector(Rng& rng, double reach) {
  Vec3<double> v;
  for (int k = 0; k < 3; ++k) v[k] = uniform(rng, -reach, reach); // in an order that compilers agree on
  return v;
}

inline void addSurfel(SurfelCloud& cloud, const Vec3<double>& p, const Vec3<double>& n) {
  cloud.p0.push_back(assume<Point3<AcquisitionSpace>>(p));
  cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace>>(n)));
}

// A hexagonal grid of the given spacing on z = 0, facing +z, within |x| <= halfX, |y| <= halfY, each surfel
// displaced by up to jitter spacings.
inline SurfelCloud sheet(double halfX, double halfY, double spacing, double jitter, Rng& rng) {
  SurfelCloud cloud;
  const double rowHeight = spacing * std::sqrt(3.0) / 2, j = jitter * spacing;
  int row = 0;
  for (double y = -halfY; y <= halfY; y += rowHeight, ++row)
    for (double x = -halfX + (row % 2) * spacing / 2; x <= halfX; x += spacing)
      addSurfel(cloud, {x + uniform(rng, -j, j), y + uniform(rng, -j, j), 0}, {0, 0, 1});
  estimateSplats(cloud);
  return cloud;
}

// count surfels on the unit sphere along a Fibonacci spiral, displaced a little.
inline SurfelCloud unitSphere(int count, Rng& rng) {
  SurfelCloud cloud;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0)), jitter = 0.4 / std::sqrt(count);
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z);
    const Vec3<double> n =
        (Vec3<double>(r * std::cos(golden * i), r * std::sin(golden * i), z) + randomVector(rng, jitter))
            .normalized();
    addSurfel(cloud, n, n);
  }
  estimateSplats(cloud);
  return cloud;
}

using Warp = std::function<Vec3<double>(const Vec3<double>&)>;

// The cloud after a warp, tangents and handedness by central differences.
inline DeformedCloud deformed(const SurfelCloud& rest, const Warp& warp) {
  constexpr double step = 1e-4;
  DeformedCloud cloud;
  for (size_t i = 0; i < rest.size(); ++i) {
    const Vec3<double> p = rest.p0[i].raw().cast<double>();
    const Mat3<double> frame = rotationOf<double>(rest.r0[i]);
    Mat3<double> warped;
    for (int k = 0; k < 3; ++k)
      warped.col(k) = (warp(p + step * frame.col(k)) - warp(p - step * frame.col(k))) / (2 * step);
    cloud.p.push_back(assume<Point3<ObjectSpace>>(warp(p)));
    cloud.u.push_back(assume<Direction3<ObjectSpace>>(warped.col(0)));
    cloud.v.push_back(assume<Direction3<ObjectSpace>>(warped.col(1)));
    cloud.handedness.push_back(warped.determinant() > 0 ? Handedness::kept : Handedness::mirrored);
  }
  return cloud;
}

inline void append(SurfelCloud& rest, DeformedCloud& cloud, const SurfelCloud& moreRest,
                   const DeformedCloud& more) {
  const auto join = [](auto& a, const auto& b) { a.insert(a.end(), b.begin(), b.end()); };
  join(rest.p0, moreRest.p0);
  join(rest.r0, moreRest.r0);
  join(rest.radius, moreRest.radius);
  join(rest.coverage, moreRest.coverage);
  join(cloud.p, more.p);
  join(cloud.u, more.u);
  join(cloud.v, more.v);
  join(cloud.handedness, more.handedness);
}

// At eye, looking at target, y up on the picture.
inline capture::Camera<ObjectSpace> lookAt(const Vec3<double>& eye, const Vec3<double>& target, int width,
                                           int height, double focal) {
  const Vec3<double> back = (eye - target).normalized();
  const Vec3<double> side = std::abs(back[1]) < 0.99 ? Vec3<double>(0, 1, 0) : Vec3<double>(0, 0, -1);
  const Vec3<double> right = side.cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  capture::Camera<ObjectSpace> camera;
  camera.lens.width = width;
  camera.lens.height = height;
  camera.lens.focalX = camera.lens.focalY = focal;
  camera.lens.centerX = width / 2.0;
  camera.lens.centerY = height / 2.0;
  camera.cameraFromWorld = {rotation, -(rotation * eye)};
  return camera;
}

} // namespace surflect::testing
