// Silhouettes of unions of balls, by exact rays; and the requirements on a closed mesh.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/geometry/mesh.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <random>
#include <set>
#include <vector>

namespace surflect::hull::shapes {

using Point = Point3<AcquisitionSpace, double>;

struct Sphere {
  Vec3<double> center = Vec3<double>::Zero();
  double radius = 1;
};

inline std::vector<Sphere> sphere() { return {{}}; }
inline std::vector<Sphere> twoLobes() { return {{{-0.45, 0, 0}, 0.5}, {{0.35, 0.1, 0}, 0.45}}; }
// A tube of radius 0.2 about a circle of radius 0.75 around the y axis, nearly: one hole.
inline std::vector<Sphere> ring() {
  std::vector<Sphere> spheres;
  for (int i = 0; i < 48; ++i) {
    const double angle = 2 * std::numbers::pi * i / 48;
    spheres.push_back({{0.75 * std::cos(angle), 0, 0.75 * std::sin(angle)}, 0.2});
  }
  return spheres;
}
inline std::vector<Sphere> randomCluster(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Sphere> spheres;
  for (int i = 0; i < 6; ++i)
    spheres.push_back(
        {0.5 * Vec3<double>(unit(random), unit(random), unit(random)), 0.2 + 0.1 * unit(random)});
  return spheres;
}

// The share of samples x samples rays through each pixel that meet the balls.
image::Image matte(const capture::Camera<AcquisitionSpace>& camera, const std::vector<Sphere>& spheres,
                   int samples = 4);

// See studio::cameraFrom: the unit sphere nearly fills the picture.
inline std::vector<capture::Camera<AcquisitionSpace>> camerasAround(int count, int size) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const auto& direction : studio::spiral(count))
    cameras.push_back(studio::cameraFrom<AcquisitionSpace>(direction, size));
  return cameras;
}

inline capture::Camera<AcquisitionSpace> orthographic(capture::Camera<AcquisitionSpace> camera) {
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.lens.focalX = camera.lens.focalY = 0.42 * camera.lens.width;
  return camera;
}

inline hull::SilhouetteView sightOf(const capture::Camera<AcquisitionSpace>& camera,
                                    const image::Image& alpha, size_t number) {
  return {studio::numbered("C", number), camera, hull::Outline(alpha)};
}
inline std::vector<hull::SilhouetteView>
silhouetteViews(const std::vector<capture::Camera<AcquisitionSpace>>& cameras,
                const std::vector<Sphere>& spheres) {
  std::vector<hull::SilhouetteView> result;
  for (const auto& camera : cameras) result.push_back(sightOf(camera, matte(camera, spheres), result.size()));
  return result;
}

inline double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    sum += mesh.positions[mesh.triangles[t][0]].cast<double>().raw().dot(areaVector(mesh, t)) / 6;
  return sum;
}

// 2 - 2 handles, for each part.
inline long eulerCharacteristic(const TriangleMesh& mesh) {
  return static_cast<long>(mesh.positions.size()) - static_cast<long>(mesh.triangles.size() / 2);
}

// Every edge in exactly two triangles, once in each direction; around each vertex one closed fan of
// triangles.
inline void expectClosedManifold(const TriangleMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> halfEdges;
  std::vector<std::map<uint32_t, uint32_t>> next(
      mesh.positions.size()); // around a vertex, neighbour to neighbour
  for (const auto& triangle : mesh.triangles)
    for (size_t c = 0; c < 3; ++c) {
      const uint32_t a = triangle[c], b = triangle[(c + 1) % 3];
      ASSERT_LT(a, mesh.positions.size());
      ASSERT_NE(a, b);
      ++halfEdges[{a, b}];
      next[a][b] = triangle[(c + 2) % 3];
    }
  for (const auto& [edge, count] : halfEdges) {
    ASSERT_EQ(count, 1) << "an edge in two triangles of one winding";
    ASSERT_TRUE(halfEdges.contains({edge.second, edge.first})) << "an edge in one triangle only";
  }
  for (const auto& fan : next) {
    ASSERT_FALSE(fan.empty()) << "a vertex without triangles";
    size_t steps = 0;
    uint32_t at = fan.begin()->first;
    do {
      at = fan.at(at);
      ++steps;
    } while (at != fan.begin()->first && steps <= fan.size());
    ASSERT_EQ(steps, fan.size()) << "a vertex with two fans";
  }
}

} // namespace surflect::hull::shapes
