#include "render/lightfield/slf/texel_radiance.h"

#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace surflect::slf {

namespace {

// A triangle in the plane z = 2 with corners (0, 0), (1, 0), (0, 1); its chart fills half of the texture.
struct Single {
  TriangleMesh mesh{{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}, {{0, 1, 2}}};
  Chart chart;

  explicit Single(int side) {
    const float low = 0.5f / static_cast<float>(side), high = 1 - low;
    chart = {{0, 1, 2}, {{low, low}, {high, low}, {low, high}}, {{0, 1, 2}}, {0}, side, side};
  }
};

TEST(TexelPoints, CornersOfAFaceAreTheOuterTexels) {
  const TriangleMesh cube = boxes::unitCube();
  constexpr int kSide = 5;
  for (const Chart& chart : boxes::faceCharts(cube, kSide)) {
    const std::vector<TexelPoint> points = texelPoints(cube, chart);
    ASSERT_EQ(points.size(), chart.texels());
    for (size_t v = 0; v < chart.vertices.size(); ++v) {
      const auto i = static_cast<size_t>(chart.coordinates[v][0] * kSide),
                 j = static_cast<size_t>(chart.coordinates[v][1] * kSide);
      const Vec3<double> corner = cube.positions[chart.vertices[v]].raw().cast<double>();
      EXPECT_NEAR((points[j * kSide + i].position.raw() - corner).norm(), 0, 1e-6);
    }
  }
}

TEST(TexelPoints, InsideTexelsLieOnTheirTriangleWhereTheChartSays) {
  constexpr int kSide = 9;
  const Single single(kSide);
  const std::vector<TexelPoint> points = texelPoints(single.mesh, single.chart);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i + j < kSide; ++i) {
      const TexelPoint& point = points[static_cast<size_t>(j * kSide + i)];
      EXPECT_TRUE(point.isInside);
      EXPECT_EQ(point.meshTriangle, 0u);
      EXPECT_NEAR((point.position.raw() - Vec3<double>(i / 8.0, j / 8.0, 2)).norm(), 0, 1e-6);
    }
}

TEST(TexelPoints, OutsideTexelsTakeTheNearestPointOfTheChart) {
  constexpr int kSide = 9;
  const Single single(kSide);
  const std::vector<TexelPoint> points = texelPoints(single.mesh, single.chart);
  for (int j = 0; j < kSide; ++j)
    for (int i = kSide - j; i < kSide; ++i) { // beyond the hypotenuse
      const TexelPoint& point = points[static_cast<size_t>(j * kSide + i)];
      EXPECT_FALSE(point.isInside);
      const double along = (8 + i - j) / 16.0;
      EXPECT_NEAR((point.position.raw() - Vec3<double>(along, 1 - along, 2)).norm(), 0, 1e-6);
    }
}

TEST(TexelPoints, NoTexelFallsBetweenTwoTriangles) {
  const TriangleMesh cube = boxes::unitCube();
  for (const int side : {4, 7, 64})
    for (const Chart& chart : boxes::faceCharts(cube, side))
      EXPECT_TRUE(std::ranges::all_of(texelPoints(cube, chart), &TexelPoint::isInside)) << side;
}

TEST(TexelPoints, TrianglesWithoutAreaTakeNoTexel) {
  Single single(6);
  single.mesh.positions.push_back({0.5f, 0.5f, 2});
  single.mesh.triangles.push_back({1, 3, 2}); // flat on the surface, though not in the chart
  single.chart.vertices.push_back(3);
  single.chart.coordinates.emplace_back(0.9f, 0.9f);
  single.chart.triangles.push_back({1, 3, 2});
  single.chart.meshTriangles.push_back(1);
  for (const TexelPoint& point : texelPoints(single.mesh, single.chart)) {
    EXPECT_EQ(point.meshTriangle, 0u);
    EXPECT_TRUE(point.position.raw().allFinite());
  }
}

TEST(TexelPoints, AChartWithoutAreaHasNoPoints) {
  Single single(4);
  for (auto& coordinates : single.chart.coordinates) coordinates = {0.5f, 0.5f};
  for (const TexelPoint& point : texelPoints(single.mesh, single.chart))
    EXPECT_EQ(point.meshTriangle, TexelPoint::kNone);
}

} // namespace

namespace {

constexpr std::array kBlends = {Blend::nearest, Blend::ulr, Blend::fitted};

// Observations from all around, of a radiance that is a function of the direction.
template <class RadianceAt>
std::vector<Observation> observe(size_t count, unsigned seed, const RadianceAt& radianceAt) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> fade(0.1f, 1);
  std::vector<Observation> observations;
  for (uint32_t v = 0; v < count; ++v) {
    const Vec3<double> towards = randomUnit(random);
    observations.push_back({v, assume<Direction3<AcquisitionSpace>>(towards),
                            radianceAt(towards).template cast<float>(), fade(random)});
  }
  return observations;
}

Vec3<double> smooth(const Vec3<double>& d) { return {1 + d[0], 2 + d[1] * d[2], 1.5 - d[2]}; }

std::vector<uint8_t> all(const DirectionMesh& mesh) {
  return std::vector<uint8_t>(mesh.directions().size(), 1);
}

TEST(TexelRadiance, AConstantIsReproducedInAllDirections) {
  const DirectionMesh mesh(octahedronDirections(2));
  const Vec3<double> color(0.3, 2, 70);
  for (const size_t count : {1, 2, 5, 60})
    for (const Blend blend : kBlends)
      for (const Vec3<float>& radiance :
           texelRadiance(blend, observe(count, 1, [&](const auto&) { return color; }), mesh, all(mesh)))
        EXPECT_NEAR((radiance.cast<double>() - color).norm(), 0, 2e-6 * color.norm());
}

TEST(TexelRadiance, NearestIsTheObservationOfLeastAngle) {
  const DirectionMesh mesh(octahedronDirections(2));
  const auto observations = observe(40, 2, smooth);
  const auto radiance = nearestRadiance(observations, mesh, all(mesh));
  for (size_t i = 0; i < radiance.size(); ++i) {
    const auto nearest = std::ranges::max_element(observations, {}, [&](const Observation& o) {
      return o.towards.raw().cast<double>().dot(mesh.directions()[i].raw());
    });
    EXPECT_EQ(radiance[i], nearest->radiance);
  }
}

TEST(TexelRadiance, AnObservationFromASampleDirectionIsItsBlendedRadiance) {
  const DirectionMesh mesh(octahedronDirections(1));
  auto observations = observe(30, 3, smooth);
  for (uint32_t i = 0; i < mesh.directions().size(); ++i) {
    Observation& own = observations[i];
    own.towards = mesh.directions()[i].cast<float>();
    own.radiance = {static_cast<float>(i), 1, 7};
  }
  const auto radiance = blendedRadiance(observations, mesh, all(mesh));
  for (size_t i = 0; i < radiance.size(); ++i)
    EXPECT_NEAR((radiance[i] - observations[i].radiance).norm(), 0, 1e-5 * observations[i].radiance.norm());
}

TEST(TexelRadiance, BlendsStayBetweenTheLeastAndTheLargestObservation) {
  const DirectionMesh mesh(octahedronDirections(2));
  const auto observations = observe(25, 4, smooth);
  Vec3<float> low = observations[0].radiance, high = low;
  for (const Observation& o : observations) low = low.cwiseMin(o.radiance), high = high.cwiseMax(o.radiance);
  for (const Vec3<float>& radiance : blendedRadiance(observations, mesh, all(mesh)))
    for (Eigen::Index c = 0; c < 3; ++c) {
      EXPECT_GE(radiance[c], low[c] - 1e-6f);
      EXPECT_LE(radiance[c], high[c] + 1e-6f);
    }
}

TEST(TexelRadiance, TheOrderOfObservationsDoesNotMatter) {
  const DirectionMesh mesh(octahedronDirections(2));
  auto observations = observe(50, 5, smooth);
  for (const Blend blend : kBlends) {
    const auto before = texelRadiance(blend, observations, mesh, all(mesh));
    std::mt19937 random(6);
    std::ranges::shuffle(observations, random);
    const auto after = texelRadiance(blend, observations, mesh, all(mesh));
    for (size_t i = 0; i < before.size(); ++i) EXPECT_NEAR((before[i] - after[i]).norm(), 0, 1e-6);
  }
}

TEST(TexelRadiance, AFadedObservationHasNoSayBesideOthers) {
  const DirectionMesh mesh(octahedronDirections(1));
  auto observations = observe(40, 7, [](const auto&) { return Vec3<double>(1, 1, 1); });
  observations[3].radiance = {1000, 1000, 1000};
  observations[3].fade = 1e-9f;
  for (const Blend blend : {Blend::ulr, Blend::fitted})
    for (const Vec3<float>& radiance : texelRadiance(blend, observations, mesh, all(mesh)))
      EXPECT_NEAR(radiance[0], 1, 1e-4);
}

TEST(TexelRadiance, DirectionsThatAreNotUsedAreBlack) {
  const DirectionMesh mesh(octahedronDirections(1));
  std::vector<uint8_t> isUsed = all(mesh);
  isUsed[2] = isUsed[11] = 0;
  const auto observations = observe(40, 8, smooth);
  for (const Blend blend : kBlends) {
    const auto some = texelRadiance(blend, observations, mesh, isUsed);
    EXPECT_TRUE(some[2].isZero() && some[11].isZero());
    EXPECT_GT(some[3].norm(), 0);
  }
}

TEST(TexelRadiance, NoiseBelowZeroIsBlack) {
  const DirectionMesh mesh(octahedronDirections(1));
  const auto observations = observe(40, 9, [](const auto&) { return Vec3<double>(-1, 1, -0.01); });
  for (const Blend blend : kBlends)
    for (const Vec3<float>& radiance : texelRadiance(blend, observations, mesh, all(mesh))) {
      EXPECT_EQ(radiance[0], 0);
      EXPECT_EQ(radiance[2], 0);
      EXPECT_GT(radiance[1], 0);
    }
}

TEST(TexelRadiance, TheFitAgreesBetterWithThePhotographsThanTheBlend) {
  const DirectionMesh mesh(octahedronDirections(1));
  const auto observations = observe(200, 10, [](const Vec3<double>& d) {
    return Vec3<double>(Vec3<double>::Constant(std::pow(std::max(0.0, d[2]), 8)));
  });
  const auto squaredError = [&](const std::vector<Vec3<float>>& radiance) {
    double sum = 0;
    for (const Observation& o : observations) {
      const HatWeights hats = mesh.weightsAt(o.towards.cast<double>());
      double value = 0;
      for (size_t c = 0; c < 3; ++c)
        value += hats.weights[c] * static_cast<double>(radiance[hats.directions[c]][0]);
      sum += static_cast<double>(o.fade) * std::pow(value - static_cast<double>(o.radiance[0]), 2);
    }
    return sum;
  };
  EXPECT_LT(squaredError(fittedRadiance(observations, mesh, all(mesh))),
            squaredError(blendedRadiance(observations, mesh, all(mesh))));
}

TEST(TexelRadiance, TheFitFindsARadianceThatHatsCanShow) {
  const DirectionMesh mesh(octahedronDirections(1));
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit;
  std::vector<Vec3<double>> truth;
  for (size_t i = 0; i < mesh.directions().size(); ++i)
    truth.emplace_back(unit(random), unit(random), unit(random));
  const auto observations = observe(2000, 12, [&](const Vec3<double>& d) {
    const HatWeights hats = mesh.weightsAt(assume<Direction>(d));
    Vec3<double> sum = Vec3<double>::Zero();
    for (size_t c = 0; c < 3; ++c) sum += hats.weights[c] * truth[hats.directions[c]];
    return sum;
  });
  double fitted = 0, blended = 0;
  const auto f = fittedRadiance(observations, mesh, all(mesh)),
             b = blendedRadiance(observations, mesh, all(mesh));
  for (size_t i = 0; i < truth.size(); ++i) {
    fitted = std::max(fitted, (f[i].cast<double>() - truth[i]).norm());
    blended = std::max(blended, (b[i].cast<double>() - truth[i]).norm());
  }
  EXPECT_LT(fitted, 0.1 * blended);
}

TEST(TexelRadiance, DirectionsThatNoObservationTouchesKeepTheBlend) {
  const DirectionMesh mesh(octahedronDirections(1));
  auto observations = observe(100, 13, smooth);
  std::erase_if(observations, [](const Observation& o) { return o.towards.z() < 0.1f; });
  const auto f = fittedRadiance(observations, mesh, all(mesh)),
             b = blendedRadiance(observations, mesh, all(mesh));
  for (size_t i = 0; i < f.size(); ++i)
    if (mesh.directions()[i].z() < -0.1) {
      EXPECT_EQ(f[i], b[i]);
    }
}

} // namespace

} // namespace surflect::slf
