#include "render/stage/surface.h"

#include "render/stage/surface_file.h"
#include "tests/render/stage/stages.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <map>

namespace surflect {
namespace {

std::vector<std::pair<std::string, Surface>> shapes(int segments = 32) {
  return {{"sphere", sphere({1, 2, 3}, 0.7, segments)},
          {"bumpy", bumpySphere({1, 2, 3}, 0.7, 0.1, 4, segments)},
          {"cylinder", cylinder({1, 2, 3}, 0.7, 1.4, segments)},
          {"box", box({1, 2, 3}, {1, 0.5, 2}, segments / 4)}};
}

// Six times the volume, by the divergence theorem.
double volumeOf(const TriangleMesh& mesh) {
  double volume = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    volume += areaVector(mesh, i).dot(mesh.positions[mesh.triangles[i][0]].cast<double>().raw()) / 6;
  return volume;
}

// Each edge is passed once each way.
bool isClosed(const TriangleMesh& mesh) {
  using Edge = std::pair<std::array<float, 3>, std::array<float, 3>>;
  std::map<Edge, int> balance;
  const auto key = [&](uint32_t i) {
    const auto& p = mesh.positions[i];
    return std::array{p.x(), p.y(), p.z()};
  };
  for (const auto& [a, b, c] : mesh.triangles)
    for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}}) {
      ++balance[{key(from), key(to)}];
      --balance[{key(to), key(from)}];
    }
  return std::ranges::all_of(balance, [](const auto& edge) { return edge.second == 0; });
}

// The largest angle between a triangle and the normals at its corners, in radians.
double largestTilt(const Surface& surface) {
  double tilt = 0;
  for (size_t i = 0; i < surface.mesh.triangles.size(); ++i)
    for (const uint32_t vertex : surface.mesh.triangles[i]) {
      const Vec3<double> facet = areaVector(surface.mesh, i).normalized();
      const Vec3<double> normal = surface.normals[vertex].raw().normalized();
      tilt = std::max(tilt, std::atan2(facet.cross(normal).norm(), facet.dot(normal)));
    }
  return tilt;
}

TEST(StageSurface, ShapesAreClosedAndTheirNormalsPointOut) {
  for (const auto& [name, surface] : shapes()) {
    EXPECT_TRUE(isClosed(surface.mesh)) << name;
    EXPECT_GT(volumeOf(surface.mesh), 0) << name;
    EXPECT_LT(largestTilt(surface), 0.4) << name;
  }
}

TEST(StageSurface, VolumesAreThoseOfTheShapes) {
  const double pi = std::numbers::pi;
  const auto fine = shapes(256);
  EXPECT_NEAR(volumeOf(fine[0].second.mesh), 4 * pi / 3 * std::pow(0.7, 3), 1e-3);
  EXPECT_NEAR(volumeOf(fine[2].second.mesh), pi * 0.49 * 1.4, 1e-3);
  EXPECT_NEAR(volumeOf(fine[3].second.mesh), 1, 1e-5);
}

TEST(StageSurface, TrianglesConvergeToTheNormals) {
  for (size_t i = 0; i < 3; ++i) {
    const double coarse = largestTilt(shapes(64)[i].second), fine = largestTilt(shapes(256)[i].second);
    EXPECT_NEAR(coarse / fine, 4, 0.5) << shapes()[i].first;
  }
}

TEST(StageSurface, TangentsLieInTheSurface) {
  for (const auto& [name, surface] : shapes())
    for (size_t i = 0; i < surface.normals.size(); ++i)
      EXPECT_NEAR(dot(surface.normals[i], surface.tangents[i]), 0, 1e-12) << name;
}

TEST(StageSurface, DeformedNormalsAreThoseOfDeformedTriangles) {
  const auto twist = twistWarp({0, 0, 1}, Angle::fromRadians(1), {1, 2, 3});
  const auto bend = bendWarp({0, 0, 1}, {1, 0, 0}, Angle::fromRadians(0.4), {1, 2, 3});
  const auto mirror = scaleWarp({-1, 2, 1}, {0, 0, 0});
  for (const Warp* warp : {twist.get(), bend.get(), mirror.get()})
    for (size_t i = 0; i < 3; ++i) {
      const Surface coarse = deformed(shapes(64)[i].second, *warp),
                    fine = deformed(shapes(256)[i].second, *warp);
      EXPECT_NEAR(largestTilt(coarse) / largestTilt(fine), 4, 0.6) << shapes()[i].first;
      EXPECT_GT(volumeOf(fine.mesh), 0) << shapes()[i].first;
      for (size_t v = 0; v < fine.normals.size(); ++v)
        EXPECT_NEAR(dot(fine.normals[v], fine.tangents[v]), 0, 1e-9);
    }
}

TEST(StageSurface, AWarpWithoutValueIsAnError) {
  const auto formula = [](const char* text) { return Expression(text, warpVariables); };
  const auto warp = expressionWarp(formula("x"), formula("y"), formula("sqrt(z - 3)"), ShotTime{});
  try {
    deformed(shapes()[0].second, *warp);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("vertex["), std::string::npos);
  }
}

TEST(StageSurface, MeshesComeFromFilesSmoothOrFaceted) {
  const TemporaryFolder folder;
  writeBytes(folder / "tent.obj", "v 0 0 0\nv 1 0 1\nv 0 2 0\nv -1 0 1\nf 1 2 3\nf 1 3 4\n");
  const Surface smooth = readSurface(folder / "tent.obj", true),
                faceted = readSurface(folder / "tent.obj", false);
  EXPECT_EQ(smooth.mesh.positions.size(), 4u);
  EXPECT_LT((smooth.normals[0].raw() - Vec3<double>::UnitZ()).norm(), 1e-7); // both triangles alike
  EXPECT_EQ(faceted.mesh.positions.size(), 6u);
  EXPECT_LT(largestTilt(faceted), 1e-7);
  EXPECT_GT(largestTilt(smooth), 0.5);
}

} // namespace
} // namespace surflect
