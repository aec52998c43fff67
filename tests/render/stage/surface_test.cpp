#include "render/stage/surface.h"

#include "render/stage/shapes.h"
#include "tests/render/stage/surfaces.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::stage {
namespace {

std::vector<Surface> shapes(int segments = 32) {
  return {sphere({1, 2, 3}, 0.7, segments), bumpySphere({1, 2, 3}, 0.7, 0.1, 4, segments),
          cylinder({1, 2, 3}, 0.7, 1.4, segments), box({1, 2, 3}, {1, 0.5, 2}, segments / 4)};
}

Mat3<double> randomMatrix(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Mat3<double> matrix;
  for (double& value : matrix.reshaped()) value = normal(random);
  return matrix;
}

warp::Expression height(const char* formula) { return warp::Expression(formula, kHeightVariables); }

TEST(StageSurface, ATransformedSurfaceHasTheVolumeTheMapGivesIt) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 10; ++trial)
    for (const Surface& shape : shapes()) {
      const Mat3<double> linear = randomMatrix(random);
      const Surface there = transformed(shape, linear, {0.3, -2, 1});
      const double factor = std::abs(linear.determinant()), volume = volumeOf(shape.mesh);
      EXPECT_NEAR(volumeOf(there.mesh), factor * volume, 1e-4 * (1 + factor));
      EXPECT_TRUE(isClosed(there.mesh));
    }
}

TEST(StageSurface, TransformedFramesAreThoseOfTransformedTriangles) {
  const Mat3<double> linear = Vec3<double>(-1, 2, 0.5).asDiagonal();
  for (size_t i = 0; i < 3; ++i) {
    const Surface coarse = transformed(shapes(64)[i], linear, {1, 0, 0}),
                  fine = transformed(shapes(256)[i], linear, {1, 0, 0});
    EXPECT_NEAR(largestTilt(coarse) / largestTilt(fine), 4, 0.6) << i;
    EXPECT_LT(largestLift(fine), 1e-9);
  }
}

TEST(StageSurface, AppendedSurfacesAreBoth) {
  const std::vector<Surface> all = shapes();
  Surface both = all[0];
  append(both, all[2]);
  EXPECT_NEAR(volumeOf(both.mesh), volumeOf(all[0].mesh) + volumeOf(all[2].mesh), 1e-6);
  EXPECT_EQ(both.textureCoordinates.size(), both.mesh.positions.size());
  EXPECT_TRUE(isClosed(both.mesh));
}

TEST(StageSurface, TangentsTurnRoundTheNormals) {
  for (const Surface& shape : shapes()) {
    const Surface turned = withTangentsTurned(shape, Angle::fromDegrees(30));
    EXPECT_LT(largestLift(turned), 1e-9);
    for (size_t i = 0; i < shape.normals.size(); ++i) {
      const Vec3<double> before = shape.tangents[i].raw(), after = turned.tangents[i].raw();
      EXPECT_NEAR(before.cross(after).dot(shape.normals[i].raw().normalized()), 0.5 * before.squaredNorm(),
                  1e-9);
    }
  }
}

TEST(StageSurface, APlanarTextureIsSeenFromAboveWithoutDistortion) {
  const Surface shape =
      withPlanarTexture(transformed(shapes()[0], Vec3<double>(1, 0.5, 2).asDiagonal(), {5, 0, 0}));
  for (size_t i = 1; i < shape.mesh.positions.size(); ++i) {
    const Vec3<double> across =
        shape.mesh.positions[i].cast<double>().raw() - shape.mesh.positions[0].cast<double>().raw();
    const Vec2<double> onTexture = shape.textureCoordinates[i] - shape.textureCoordinates[0];
    EXPECT_LT((across.head<2>() / 1.4 - onTexture).norm(), 1e-6);
    EXPECT_GE(shape.textureCoordinates[i].minCoeff(), -1e-12);
    EXPECT_LE(shape.textureCoordinates[i].maxCoeff(), 1 + 1e-12);
  }
}

TEST(StageSurface, AConstantHeightMakesALargerSphere) {
  const Surface larger = displaced(sphere({0, 0, 0}, 1, 256), height("0.25"));
  for (const auto& p : larger.mesh.positions) EXPECT_NEAR(p.raw().norm(), 1.25, 1e-6);
  EXPECT_TRUE(isClosed(larger.mesh));
}

TEST(StageSurface, ASphereDisplacedByBumpsIsTheBumpySphere) {
  const auto bumps = height("0.1*sin(4*x)*sin(4*y)*sin(4*z)");
  const auto worst = [&](int segments) {
    const Surface one = displaced(sphere({0, 0, 0}, 1, segments), bumps),
                  other = bumpySphere({0, 0, 0}, 1, 0.1, 4, segments);
    double angle = 0;
    for (size_t i = 0; i < one.normals.size(); ++i) {
      EXPECT_LT((one.mesh.positions[i].raw() - other.mesh.positions[i].raw()).norm(), 1e-5f);
      angle = std::max(angle, one.normals[i].raw().cross(other.normals[i].raw()).norm());
    }
    EXPECT_LT(largestLift(one), 1e-9);
    return angle;
  };
  const double coarse = worst(64), fine = worst(256);
  EXPECT_LT(fine, std::numbers::pi / 256); // half a triangle's side
  EXPECT_GT(coarse / fine, 3); // first order at least: triangles of a net are not symmetric about a vertex
}

TEST(StageSurface, DisplacedSurfacesStayClosedAndCreasesSharp) {
  for (const Surface& shape : shapes())
    EXPECT_TRUE(isClosed(displaced(shape, height("0.1*cos(6*pi*s)*t")).mesh));
  const Surface cube = displaced(box({0, 0, 0}, {1, 1, 1}, 8), height("0"));
  EXPECT_LT(largestTilt(cube), 1e-6);
}

TEST(StageSurface, AHeightWithoutValueIsAnError) {
  EXPECT_THROW(displaced(shapes()[0], height("1/0")), Error);
  EXPECT_THROW(displaced(shapes()[0], height("sqrt(-1-x*x)")), Error);
}

TEST(StageSurface, DeformedNormalsAreThoseOfDeformedTriangles) {
  const auto twist = warp::twistWarp({0, 0, 1}, Angle::fromRadians(1), {1, 2, 3});
  const auto bend = warp::bendWarp({0, 0, 1}, {1, 0, 0}, Angle::fromRadians(0.4), {1, 2, 3});
  const auto mirror = warp::scaleWarp({-1, 2, 1}, {0, 0, 0});
  for (const warp::Warp* warp : {twist.get(), bend.get(), mirror.get()})
    for (size_t i = 0; i < 3; ++i) {
      const Surface coarse = deformed(shapes(64)[i], *warp), fine = deformed(shapes(256)[i], *warp);
      EXPECT_NEAR(largestTilt(coarse) / largestTilt(fine), 4, 0.6) << i;
      EXPECT_GT(volumeOf(fine.mesh), 0) << i;
      for (size_t v = 0; v < fine.normals.size(); ++v)
        EXPECT_NEAR(dot(fine.normals[v], fine.tangents[v]), 0, 1e-9);
    }
}

TEST(StageSurface, AWarpWithoutValueIsAnError) {
  const auto formula = [](const char* text) { return warp::Expression(text, warp::warpVariables); };
  const auto warp =
      warp::expressionWarp(formula("x"), formula("y"), formula("sqrt(z - 3)"), warp::ShotTime{});
  try {
    deformed(shapes()[0], *warp);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("vertex["), std::string::npos);
  }
}

} // namespace
} // namespace surflect::stage
