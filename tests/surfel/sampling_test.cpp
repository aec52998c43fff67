#include "surfel/sampling.h"

#include "surfel/geometry/neighbors.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect {
namespace {

TriangleMesh sphereMesh(int rings) {
  TriangleMesh mesh;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j <= 2 * rings; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = std::numbers::pi * j / rings;
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(
          Vec3<double>(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta))));
    }
  const auto at = [&](int i, int j) { return static_cast<uint32_t>(i * (2 * rings + 1) + j); };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < 2 * rings; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

const SurfelCloud& sphereCloud() {
  static const SurfelCloud cloud = sampleSurfels(sphereMesh(64), 0.04);
  return cloud;
}

Point3<AcquisitionSpace> randomOnSphere(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return assume<Point3<AcquisitionSpace>>(
      Vec3<double>(normal(random), normal(random), normal(random)).normalized());
}

TEST(Sampling, SurfelsKeepTheirDistance) {
  const NeighborIndex index(sphereCloud().p0);
  for (const auto& p : sphereCloud().p0) EXPECT_GE(index.nearest(p, 2)[1].distance, 0.3f * 0.04f);
}

TEST(Sampling, EveryPointOfTheSurfaceLiesInADisc) {
  const NeighborIndex index(sphereCloud().p0);
  std::mt19937 random(7);
  for (int i = 0; i < 20000; ++i) {
    const auto nearest = index.nearest(randomOnSphere(random), 1)[0];
    EXPECT_LE(nearest.distance, sphereCloud().radius[nearest.index]);
  }
}

TEST(Sampling, GaussiansSumToOneBetweenTheSurfels) {
  const auto& cloud = sphereCloud();
  const NeighborIndex index(cloud.p0);
  std::mt19937 random(8);
  double worst = 0, sumOfSquares = 0;
  constexpr int kPoints = 5000;
  for (int i = 0; i < kPoints; ++i) {
    const auto p = randomOnSphere(random);
    double sum = 0;
    for (const auto& [j, distance] : index.within(p, 0.2f)) {
      const double sigma = kSigmaPerRadius * cloud.radius[j];
      sum += cloud.coverage[j] * std::exp(-0.5 * distance * distance / (sigma * sigma));
    }
    worst = std::max(worst, std::abs(sum - 1));
    sumOfSquares += (sum - 1) * (sum - 1);
  }
  EXPECT_LT(worst, 0.1);
  EXPECT_LT(std::sqrt(sumOfSquares / kPoints), 0.02);
}

TriangleMesh rectangle(float width, float height) {
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair{0.f, 0.f}, {width, 0.f}, {width, height}, {0.f, height}})
    mesh.positions.emplace_back(x, y, 0.f);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

// A half-plane blurred by a Gaussian (measured: within 0.03; 0.3 if Gaussians summed to 1 there, too).
TEST(Sampling, GaussiansFallToAHalfAtABorder) {
  const auto cloud = sampleSurfels(rectangle(8, 2), 0.05);
  const NeighborIndex index(cloud.p0);
  const double sigma = kSigmaPerRadius * 0.05;
  for (const double inside : {-2.0, -1.0, 0.0, 1.0, 2.0, 3.0}) { // sigmas
    constexpr int kPoints = 2000;
    double sum = 0;
    for (int i = 0; i < kPoints; ++i) {
      const auto p =
          assume<Point3<AcquisitionSpace>>(Vec3<double>(0.5 + 7.0 * i / kPoints, inside * sigma, 0));
      for (const auto& [j, distance] : index.within(p, 0.2f)) {
        const double ofSplat = kSigmaPerRadius * cloud.radius[j];
        sum += cloud.coverage[j] * std::exp(-0.5 * distance * distance / (ofSplat * ofSplat));
      }
    }
    EXPECT_NEAR(sum / kPoints, 0.5 * std::erfc(-inside / std::numbers::sqrt2), 0.04) << inside;
  }
}

TEST(Sampling, SplatsHaveTheAreaOfTheSheet) {
  for (const auto& [width, height] : {std::pair{1.f, 1.f}, {0.3f, 2.f}}) {
    const auto cloud = sampleSurfels(rectangle(width, height), 0.03);
    double area = 0;
    for (size_t i = 0; i < cloud.size(); ++i) {
      const double sigma = kSigmaPerRadius * cloud.radius[i];
      area += cloud.coverage[i] * 2 * std::numbers::pi * sigma * sigma;
    }
    EXPECT_NEAR(area / (double{width} * height), 1, 0.03) << width;
  }
}

TEST(Sampling, SpacingForACountYieldsAboutThatCount) {
  const TriangleMesh mesh = sphereMesh(32);
  for (const size_t count : {500u, 5000u})
    EXPECT_NEAR(static_cast<double>(sampleSurfels(mesh, spacingFor(mesh, count)).size()),
                static_cast<double>(count), 0.04 * static_cast<double>(count));
}

TEST(Sampling, NormalsAreThoseOfTheBall) {
  const auto& cloud = sphereCloud();
  for (size_t i = 0; i < cloud.size(); ++i)
    EXPECT_GT(rotationOf<float>(cloud.r0[i]).col(2).dot(cloud.p0[i].raw().normalized()),
              0.9995f); // of triangles: 0.998
}

TEST(Sampling, BothSidesOfAThinWallAreCovered) {
  TriangleMesh wall;
  for (const float z : {0.f, 0.001f})
    for (const auto& [x, y] : {std::pair{0.f, 0.f}, {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
      wall.positions.emplace_back(x, y, z);
  wall.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
  const auto cloud = sampleSurfels(wall, 0.05);
  size_t up = 0;
  for (size_t i = 0; i < cloud.size(); ++i) up += rotationOf<float>(cloud.r0[i])(2, 2) > 0;
  EXPECT_NEAR(static_cast<double>(up) / static_cast<double>(cloud.size()), 0.5, 0.05);
  const NeighborIndex index(cloud.p0);
  double mean = 0;
  size_t inside = 0;
  for (size_t i = 0; i < cloud.size(); ++i) { // each side sums to one by itself, but for its border
    if ((cloud.p0[i].raw().head<2>().array() - 0.5f).abs().maxCoeff() > 0.5f - 0.1f) continue;
    double sum = 0;
    for (const auto& [j, distance] : index.within(cloud.p0[i], 0.3f)) {
      const double sigma = kSigmaPerRadius * cloud.radius[j];
      if (rotationOf<float>(cloud.r0[i])(2, 2) * rotationOf<float>(cloud.r0[j])(2, 2) > 0)
        sum += cloud.coverage[j] * std::exp(-0.5 * distance * distance / (sigma * sigma));
    }
    EXPECT_GT(sum, 0.7); // or there would be holes, see kOpaqueArea
    EXPECT_LT(sum, 1.15);
    mean += sum;
    ++inside;
  }
  EXPECT_NEAR(mean / static_cast<double>(inside), 1, 0.02); // 2 if both sides were taken together
}

TEST(Sampling, TheSameSeedGivesTheSameCloud) {
  const TriangleMesh mesh = sphereMesh(16);
  const auto a = sampleSurfels(mesh, 0.1, 3), b = sampleSurfels(mesh, 0.1, 3);
  EXPECT_EQ(a.p0, b.p0);
  EXPECT_EQ(a.coverage, b.coverage);
}

TEST(Sampling, SameBitsForAnyThreads) {
  const TriangleMesh mesh = sphereMesh(64);
  for (const int threads : {1, 2, 5})
    tbb::task_arena(threads).execute([&] {
      const SurfelCloud cloud = sampleSurfels(mesh, 0.04);
      EXPECT_EQ(cloud.p0, sphereCloud().p0);
      EXPECT_EQ(cloud.radius, sphereCloud().radius);
      EXPECT_EQ(cloud.coverage, sphereCloud().coverage);
    });
}

} // namespace
} // namespace surflect
