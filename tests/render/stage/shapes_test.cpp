#include "render/stage/shapes.h"

#include "surfel/base/error.h"
#include "tests/render/stage/surfaces.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::stage {
namespace {

std::vector<std::pair<std::string, Surface>> namedShapes(int segments = 32) {
  return {
      {"sphere", sphere({1, 2, 3}, 0.7, segments)},
      {"bumpy", bumpySphere({1, 2, 3}, 0.7, 0.1, 4, segments)},
      {"cylinder", cylinder({1, 2, 3}, 0.7, 1.4, segments)},
      {"lathe", lathe(std::vector<ProfilePoint>{{0.3, -1}, {0.5, 0}, {0.2, 0.4}, {0, 0.5}}, true, segments)},
      {"box", box({1, 2, 3}, {1, 0.5, 2}, segments / 4)}};
}

TEST(StageShapes, ShapesAreClosedAndTheirNormalsPointOut) {
  for (const auto& [name, surface] : namedShapes()) {
    EXPECT_TRUE(isClosed(surface.mesh)) << name;
    EXPECT_GT(volumeOf(surface.mesh), 0) << name;
    EXPECT_LT(largestTilt(surface), 0.4) << name;
  }
}

TEST(StageShapes, VolumesAreThoseOfTheShapes) {
  const double pi = std::numbers::pi;
  const auto fine = namedShapes(256);
  EXPECT_NEAR(volumeOf(fine[0].second.mesh), 4 * pi / 3 * std::pow(0.7, 3), 1e-3);
  EXPECT_NEAR(volumeOf(fine[2].second.mesh), pi * 0.49 * 1.4, 1e-3);
  EXPECT_NEAR(volumeOf(fine[4].second.mesh), 1, 1e-5);
}

TEST(StageShapes, TrianglesConvergeToTheNormals) {
  for (size_t i = 0; i < 3; ++i) {
    const double coarse = largestTilt(namedShapes(64)[i].second),
                 fine = largestTilt(namedShapes(256)[i].second);
    EXPECT_NEAR(coarse / fine, 4, 0.5) << namedShapes()[i].first;
  }
}

TEST(StageShapes, TangentsLieInTheSurface) {
  for (const auto& [name, surface] : namedShapes()) EXPECT_LT(largestLift(surface), 1e-9) << name;
}

std::vector<ProfilePoint> line(double r0, double z0, double r1, double z1) { return {{r0, z0}, {r1, z1}}; }

TEST(StageShapes, AStraightProfileTurnsIntoACylinder) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> length(0.2, 2);
  for (int trial = 0; trial < 5; ++trial) {
    const double radius = length(random), height = length(random);
    const Surface turned = lathe(line(radius, -height / 2, radius, height / 2), true, 256),
                  known = cylinder({0, 0, 0}, radius, height, 256);
    EXPECT_NEAR(volumeOf(turned.mesh), volumeOf(known.mesh), 1e-5);
    EXPECT_NEAR(areaOf(turned.mesh), areaOf(known.mesh), 1e-5);
    EXPECT_TRUE(isClosed(turned.mesh));
    EXPECT_LT(largestTilt(turned), 0.02);
  }
}

TEST(StageShapes, ASlantedProfileTurnsIntoACone) {
  const double r = 0.6, h = 0.8, slant = std::hypot(r, h);
  const std::vector<ProfilePoint> profile{{r, 0}, {r / 2, h / 2}, {r / 2, h / 2}, {0, h}, {0, h}};
  EXPECT_THROW(lathe(profile, true, 64), Error); // the last point is alone behind its crease
  const Surface cone = lathe(std::vector<ProfilePoint>{{r, 0}, {r / 2, h / 2}}, true, 512);
  EXPECT_NEAR(volumeOf(cone.mesh), std::numbers::pi * h / 2 * (r * r + r * r / 2 + r * r / 4) / 3, 2e-4);
  EXPECT_NEAR(areaOf(cone.mesh), std::numbers::pi * (r * r + r * r / 4 + slant / 2 * (r + r / 2)), 1e-3);
}

TEST(StageShapes, AProfileRoundACircleTurnsIntoASphere) {
  const auto errorOf = [](int points) {
    std::vector<ProfilePoint> profile;
    for (int i = 0; i <= points; ++i) {
      const bool isPole = i == 0 || i == points;
      profile.push_back(
          {isPole ? 0 : std::sin(std::numbers::pi * i / points), -std::cos(std::numbers::pi * i / points)});
    }
    const Surface ball = lathe(profile, true, 128);
    double error = 0;
    for (size_t i = 0; i < ball.normals.size(); ++i)
      error = std::max(error, (ball.normals[i].raw() - ball.mesh.positions[i].cast<double>().raw()).norm());
    return error;
  };
  const double coarse = errorOf(6), fine = errorOf(24);
  EXPECT_LT(fine, 0.01);
  EXPECT_GT(coarse / fine, 10); // second order
}

TEST(StageShapes, TrianglesOfALatheConvergeToItsNormals) {
  // Rows are whole numbers, so that their height is not in proportion to `segments`.
  const double coarse = largestTilt(namedShapes(64)[3].second),
               fine = largestTilt(namedShapes(512)[3].second);
  EXPECT_GT(coarse / fine, 6);
  EXPECT_LT(fine, 0.03);
}

TEST(StageShapes, ACreaseHasTwoNormalsAndASmoothPointOne) {
  const std::vector<ProfilePoint> smooth{{0.5, 0}, {0.5, 1}, {0.2, 1.2}},
      creased{{0.5, 0}, {0.5, 1}, {0.5, 1}, {0.2, 1.2}};
  const auto normalsAtEdge = [](const Surface& surface) {
    std::vector<double> slopes; // z of unit normals on the edge, straight ahead
    for (size_t i = 0; i < surface.normals.size(); ++i)
      if (const auto& p = surface.mesh.positions[i]; p.z() == 1 && p.y() == 0 && p.x() > 0)
        if (const double z = surface.normals[i].raw().z();
            std::ranges::none_of(slopes, [&](double other) { return std::abs(other - z) < 1e-6; }))
          slopes.push_back(z);
    return slopes;
  };
  EXPECT_EQ(normalsAtEdge(lathe(creased, false, 64)).size(), 2u);
  EXPECT_LE(normalsAtEdge(lathe(smooth, false, 64)).size(), 1u);
  EXPECT_TRUE(isClosed(lathe(creased, true, 64).mesh));
  EXPECT_FALSE(isClosed(lathe(creased, false, 64).mesh));
}

TEST(StageShapes, ATextureGoesAlongAProfileByLength) {
  const Surface turned = lathe(std::vector<ProfilePoint>{{0.3, 0}, {0.5, 1}}, false, 64);
  for (size_t i = 0; i < turned.mesh.positions.size(); ++i)
    EXPECT_NEAR(turned.textureCoordinates[i].y(), turned.mesh.positions[i].z(), 1e-6);
}

} // namespace
} // namespace surflect::stage
