// A lumigraph of a bumpy sphere with closed-form radiance, without photographs.
#pragma once

#include "render/lightfield/common/pull_push.h"
#include "render/lightfield/lumigraph/slab.h"
#include "srf/capture/camera.h"
#include "srf/image/half_float.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/render/lightfield/common/bumpy_sphere.h"
#include "tests/support/random.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::lumigraph {

using lightfield::bumpySphere;

// Radiance of a point towards a unit direction.
using Radiance = std::function<Eigen::Vector3d(const Point&, const Direction&)>;

inline Eigen::Vector3d glossy(const Point& p, const Direction& towards) {
  const Vec3<double> q = p.raw();
  const double texture = 0.5 + 0.4 * std::sin(5 * q[0] + 1) * std::cos(4 * q[1] - 3 * q[2]);
  const double highlight = std::pow(std::max(0., towards.raw().dot(Vec3<double>(0.6, 0.64, 0.48))), 8);
  return {texture + highlight, 0.5 * texture + highlight, 0.3 + highlight};
}

inline Lumigraph lumigraphFrom(const TriangleMesh& mesh, const SlabOptions& options,
                               const Radiance& radiance) {
  Lumigraph lumigraph;
  lumigraph.slabs = slabsAround(mesh, options);
  lumigraph.overlap = options.overlap;
  lumigraph.geometry.mesh = mesh;
  const RayCaster<AcquisitionSpace> rays(mesh);
  for (size_t k = 0; k < kSlabs; ++k) {
    const Slab& slab = lumigraph.slabs[k];
    for (int j = 0; j < slab.nodes; ++j)
      for (int i = 0; i < slab.nodes; ++i) {
        std::vector<Eigen::Vector4f> colors(slab.nodeTexels(), Eigen::Vector4f::Zero());
        for (int y = 0; y < slab.height; ++y)
          for (int x = 0; x < slab.width; ++x) {
            const Line line = slab.lineOf({double(i), double(j), x + 0.5, y + 0.5});
            const auto hit = rays.firstHit(line.origin, line.direction);
            if (!hit) continue;
            const Point p = line.origin + hit->distance * line.direction;
            colors[y * slab.width + x] << radiance(p, -line.direction).cast<float>(), 1;
          }
        std::vector<Eigen::Vector4f> filled = colors;
        lightfield::pullPush(filled, slab.width, slab.height);
        for (const Eigen::Vector4f& color : filled)
          lumigraph.texels[k].push_back({image::nearestHalf(color[0]), image::nearestHalf(color[1]),
                                         image::nearestHalf(color[2]), image::nearestHalf(color[3])});
      }
  }
  return lumigraph;
}

// Looks from a point to another, with square pictures.
inline capture::Camera<AcquisitionSpace> lookingAt(const Vec3<double>& from, const Vec3<double>& to, int size,
                                                   double fovDeg = 40) {
  const Vec3<double> back = (from - to).normalized();
  const Vec3<double> side = std::abs(back[1]) < 0.9 ? Vec3<double>(0, 1, 0) : Vec3<double>(0, 0, 1);
  const Vec3<double> right = side.cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  capture::Camera<AcquisitionSpace> camera;
  camera.lens.width = camera.lens.height = size;
  camera.lens.centerX = camera.lens.centerY = size / 2.0;
  camera.lens.focalX = camera.lens.focalY = size / 2.0 / std::tan(fovDeg * std::numbers::pi / 360);
  camera.cameraFromWorld = {rotation, -(rotation * from)};
  return camera;
}

// Looks near the origin from 2.5 to 6 away.
inline capture::Camera<AcquisitionSpace> randomCamera(std::mt19937& random, int size) {
  const double distance = std::uniform_real_distribution(2.5, 6.)(random);
  const Vec3<double> from = distance * randomUnit(random), to = 0.2 * randomUnit(random);
  return lookingAt(from, to, size, 40 * 4 / distance);
}

} // namespace surflect::lumigraph
