#include "srf/proxy/relief/relief.h"

#include "srf/proxy/relief/frontal_plane.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>

namespace surflect::relief {
namespace {

capture::Camera<AcquisitionSpace> turnedCamera(capture::Lens::Model model) {
  capture::Camera<AcquisitionSpace> camera;
  camera.lens = {model, 30, 21, 40, 42, 14, 11, 0, 0, 0, 0};
  if (model == capture::Lens::Model::pinhole) camera.lens.k1 = -0.1;
  const Mat3<double> turn = Eigen::AngleAxisd(-0.9, Vec3<double>(1, 1, 3).normalized()).toRotationMatrix();
  camera.cameraFromWorld = {turn, {0.1, -0.05, -2.5}};
  return camera;
}

image::Mask raggedMask(uint32_t seed) {
  std::mt19937 random(seed);
  image::Mask mask(30, 21);
  for (int y = 0; y < 21; ++y)
    for (int x = 0; x < 30; ++x) // a full part, a ragged part, and nothing at the right
      mask.inside[static_cast<size_t>(y * 30 + x)] = x < 17 || (x < 26 && random() % 3 > 0);
  return mask;
}

DepthMap wavyDepth(const capture::Camera<AcquisitionSpace>& camera, const image::Mask& mask) {
  DepthMap map{mask, std::vector<double>(mask.inside.size()), {}};
  for (size_t i = 0; i < map.depth.size(); ++i) {
    const Vec2<double> q =
        *imagePoint(camera.lens, {static_cast<double>(i % 30) + 0.5, static_cast<double>(i / 30) + 0.5});
    map.depth[i] = std::exp(1 + 0.3 * q[0] - 0.2 * q[1]);
    const double slope = camera.lens.model == capture::Lens::Model::pinhole ? 1 : map.depth[i];
    map.gradient.push_back(slope * Vec2<double>(0.3, -0.2));
  }
  return map;
}

// The twice signed area of a triangle in the picture, square pixels; above 0 where it faces the camera.
double areaInPicture(const capture::Camera<AcquisitionSpace>& camera, const TriangleMesh& mesh,
                     size_t triangle) {
  std::array<Vec2<double>, 3> corners;
  for (size_t c = 0; c < 3; ++c) {
    const auto pixel = camera.project(mesh.positions[mesh.triangles[triangle][c]].cast<double>());
    corners[c] = {pixel->x, pixel->y};
  }
  const Vec2<double> a = corners[1] - corners[0], b = corners[2] - corners[0];
  return a[1] * b[0] - a[0] * b[1]; // rows go down
}

// All triangles face the camera, and corners are those of pixels, each coordinate moved by so much at most.
void expectFaces(const capture::Camera<AcquisitionSpace>& camera, const TriangleMesh& mesh, double moved) {
  for (size_t t = 0; t < mesh.triangles.size(); ++t) EXPECT_GT(areaInPicture(camera, mesh, t), 0);
  for (const auto& p : mesh.positions) {
    const auto pixel = camera.project(p.cast<double>());
    EXPECT_LT(std::abs(pixel->x - std::round(pixel->x)), moved + 1e-4);
    EXPECT_LT(std::abs(pixel->y - std::round(pixel->y)), moved + 1e-4);
  }
}

// Every pixel of the mask is covered once, and nothing else: the pieces of the mesh that lie in a pixel's
// square, found by their centres, have its area.
void expectCovers(const capture::Camera<AcquisitionSpace>& camera, const TriangleMesh& mesh,
                  const image::Mask& mask) {
  expectFaces(camera, mesh, 0);
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    area += areaInPicture(camera, mesh, t) / 2;
    Vec2<double> center = Vec2<double>::Zero();
    for (const uint32_t corner : mesh.triangles[t]) {
      const auto pixel = camera.project(mesh.positions[corner].cast<double>());
      center += Vec2<double>(pixel->x, pixel->y) / 3;
    }
    EXPECT_TRUE(mask.inside[static_cast<size_t>(center[1]) * 30 + static_cast<size_t>(center[0])]);
  }
  EXPECT_NEAR(area, static_cast<double>(std::ranges::count(mask.inside, 1)), 1e-2);
}

TEST(ReliefMesh, HasAQuadAPixelAndFacesTheCamera) {
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const auto camera = turnedCamera(model);
    for (uint32_t seed = 1; seed < 4; ++seed) {
      const image::Mask mask = raggedMask(seed);
      const TriangleMesh mesh = reliefMesh(camera, wavyDepth(camera, mask));
      EXPECT_EQ(mesh.triangles.size(), 2 * static_cast<size_t>(std::ranges::count(mask.inside, 1)));
      expectFaces(camera, mesh, 0.45);
    }
  }
}

// Edges of one triangle only, seen in the picture.
std::vector<std::array<Vec2<double>, 2>> outlineOf(const capture::Camera<AcquisitionSpace>& camera,
                                                   const TriangleMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> uses;
  for (const auto& corners : mesh.triangles)
    for (size_t c = 0; c < 3; ++c) ++uses[std::minmax({corners[c], corners[(c + 1) % 3]})];
  const auto seen = [&](uint32_t corner) -> Vec2<double> {
    const auto pixel = camera.project(mesh.positions[corner].cast<double>());
    return {pixel->x, pixel->y};
  };
  std::vector<std::array<Vec2<double>, 2>> edges;
  for (const auto& [ends, count] : uses)
    if (count == 1) edges.push_back({seen(ends.first), seen(ends.second)});
  return edges;
}

TEST(ReliefMesh, TheOutlineOfADiscIsACircle) {
  auto camera = turnedCamera(capture::Lens::Model::orthographic);
  camera.lens.width = camera.lens.height = 100;
  const Vec2<double> middle(50.3, 49.6);
  const double radius = 41;
  image::Mask mask(100, 100);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x)
      mask.inside[static_cast<size_t>(y * 100 + x)] =
          (Vec2<double>(x + 0.5, y + 0.5) - middle).norm() < radius;
  const std::vector<double> depth(mask.inside.size(), 2.0);
  const std::vector<Vec2<double>> flat(mask.inside.size(), Vec2<double>::Zero());
  const auto edges = outlineOf(camera, reliefMesh(camera, {mask, depth, flat}));
  EXPECT_GT(edges.size(), 300);
  double squares = 0;
  for (const auto& [a, b] : edges) {
    const Vec2<double> out = ((a + b) / 2 - middle).normalized();
    EXPECT_LT(std::abs(out.dot((b - a).normalized())), std::sin(0.25))
        << a.transpose();                                   // of stairs up to 0.7
    EXPECT_LT(std::abs((a - middle).norm() - radius), 0.5); // of stairs 0.7
    squares += std::pow((a - middle).norm() - radius, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(edges.size())), 0.2); // of stairs 0.35
}

TEST(ReliefMesh, CornersLieOnTheSurface) {
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const auto camera = turnedCamera(model);
    const TriangleMesh mesh = reliefMesh(camera, wavyDepth(camera, raggedMask(5)));
    for (const auto& p : mesh.positions) {
      const auto seen = camera.cameraFromWorld(p.cast<double>());
      const auto pixel = capture::project(camera.lens, seen);
      const Vec2<double> q = *imagePoint(camera.lens, *pixel);
      // Exact for pinholes, whose logarithm of depth is linear; half a pixel squared for the others.
      EXPECT_NEAR(-seen.z(), std::exp(1 + 0.3 * q[0] - 0.2 * q[1]),
                  model == capture::Lens::Model::pinhole ? 2e-6 : 1e-4);
    }
  }
}

TEST(PlaneMesh, CoversTheMaskInThePlaneOfTheOrigin) {
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const auto camera = turnedCamera(model);
    const image::Mask mask = raggedMask(6);
    const TriangleMesh mesh = planeMesh(camera, mask);
    EXPECT_LT(mesh.triangles.size(), 1.5 * static_cast<double>(std::ranges::count(mask.inside, 1)));
    for (const auto& p : mesh.positions)
      EXPECT_NEAR(camera.cameraFromWorld(p.cast<double>()).z(), -frontalDepth(camera), 1e-6);
    if (model == capture::Lens::Model::orthographic) expectCovers(camera, mesh, mask);
  }
}

TEST(PlaneMesh, WithoutObjectIsEmpty) {
  EXPECT_TRUE(planeMesh(turnedCamera(capture::Lens::Model::pinhole), image::Mask(30, 21)).triangles.empty());
}

} // namespace
} // namespace surflect::relief
