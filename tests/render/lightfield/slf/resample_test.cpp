#include "render/lightfield/slf/resample.h"

#include "srf/image/half_float.h"
#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace surflect::slf {

namespace {

constexpr int kPlateSide = 12;

// The upper face of a cube with a plate above it, photographed from straight above and around there, so that
// nothing sees the middle of the face.
struct HiddenMiddle {
  image::TemporaryFolder folder;
  lightfield::Views views;
  Chart chart;
  std::vector<TexelPoint> points;
  Observations observations;
  DirectionMesh directions{octahedronDirections(1)};

  static const std::filesystem::path& shot(const image::TemporaryFolder& folder) {
    TriangleMesh mesh = boxes::unitCube();
    boxes::addBox(mesh, {-0.2f, -0.2f, 0.55f}, {0.2f, 0.2f, 0.6f});
    const auto radiance = [](const Vec3<double>& place, const Vec3<double>&) {
      return place[2] > 0.52 ? Rgb{50, 50, 50} : Rgb{1, static_cast<float>(1 + place[0]), 2};
    };
    boxes::writeCapture(mesh, radiance, {{{0, 0, 1}, {0.1, 0, 1}, {0, 0.1, 1}, {-0.1, -0.1, 1}}, 96, 0.2},
                        folder.path());
    return folder.path();
  }
  static Chart top(const TriangleMesh& mesh) {
    const std::vector<Chart> charts = boxes::faceCharts(mesh, kPlateSide);
    return *std::ranges::find_if(charts, [&](const Chart& face) {
      return areaVector(mesh, face.meshTriangles[0]).normalized()[2] > 0.9 &&
             std::abs(mesh.positions[face.vertices[0]].z() - 0.5f) < 1e-3f;
    });
  }
  HiddenMiddle()
      : views(shot(folder)), chart(top(views.mesh())), points(texelPoints(views.mesh(), chart)),
        observations(observed(views, points)) {}
  static Observations observed(const lightfield::Views& views, const std::vector<TexelPoint>& points) {
    const lightfield::Photographs photographs(views);
    return {points, views.mesh(), SmoothNormals(views.mesh()), lightfield::Sight(photographs, views.rays())};
  }
};

TEST(Resample, TexelsThatNoPhotographSeesAreFilledSmoothlyAndMarked) {
  const HiddenMiddle scene;
  const std::vector<uint8_t> isUsed = usedDirections(scene.views.mesh(), scene.chart, scene.directions);
  for (const Blend blend : {Blend::nearest, Blend::ulr, Blend::fitted}) {
    const RegionTextures textures = resample(scene.observations, kPlateSide, scene.directions, isUsed, blend);
    EXPECT_GE(textures.unseenTexels, 9u);
    EXPECT_FALSE(textures.isUnseen());
    for (size_t i = 0; i < isUsed.size(); ++i) {
      ASSERT_EQ(textures.textures[i].size(), isUsed[i] ? scene.points.size() : 0);
      if (!isUsed[i]) continue;
      for (size_t texel = 0; texel < scene.points.size(); ++texel) {
        const Texel& value = textures.textures[i][texel];
        EXPECT_NEAR(image::floatOfHalf(value[0]), 1, 2e-3) << "the plate must not bleed";
        EXPECT_NEAR(image::floatOfHalf(value[1]), 1 + scene.points[texel].position.x(), 0.1);
        if (scene.observations.of(texel).empty()) {
          EXPECT_EQ(value[3], 0);
        }
      }
    }
  }
}

TEST(Resample, ATexelIsObservedWhereAPhotographIsWithinTheSpacingOfDirections) {
  const HiddenMiddle scene;
  const std::vector<uint8_t> isUsed(scene.directions.directions().size(), 1);
  const RegionTextures textures =
      resample(scene.observations, kPlateSide, scene.directions, isUsed, Blend::ulr);
  for (size_t i = 0; i < isUsed.size(); ++i) {
    double spacing = 0;
    for (const auto& corners : scene.directions.triangles())
      if (std::ranges::find(corners, i) != corners.end())
        for (const uint32_t other : corners)
          spacing = std::max(spacing, std::acos(std::min(1.0, dot(scene.directions.directions()[i],
                                                                  scene.directions.directions()[other]))));
    for (size_t texel = 0; texel < scene.points.size(); ++texel) {
      double least = 4;
      for (const Observation& o : scene.observations.of(texel))
        least = std::min(
            least, std::acos(o.towards.cast<double>().raw().dot(scene.directions.directions()[i].raw())));
      if (std::abs(least - spacing) < 1e-3) continue;
      EXPECT_EQ(textures.textures[i][texel][3] != 0, least < spacing);
    }
  }
}

TEST(Resample, ARegionThatNoPhotographSeesIsBlackAndNotObserved) {
  const HiddenMiddle scene;
  const std::vector<TexelPoint> nowhere(16);
  const Observations none = HiddenMiddle::observed(scene.views, nowhere);
  const std::vector<uint8_t> isUsed(scene.directions.directions().size(), 1);
  const RegionTextures textures = resample(none, 4, scene.directions, isUsed, Blend::fitted);
  EXPECT_TRUE(textures.isUnseen());
  for (const auto& texture : textures.textures)
    EXPECT_TRUE(std::ranges::all_of(texture, [](const Texel& texel) { return texel == Texel{}; }));
}

TEST(Resample, TexelsAreFiniteWhateverTheRadiance) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const Texel texel = texelOf({1e30f, -kInfinity, std::numeric_limits<float>::quiet_NaN()}, true);
  EXPECT_EQ(image::floatOfHalf(texel[0]), 65504);
  EXPECT_EQ(image::floatOfHalf(texel[1]), -65504);
  EXPECT_EQ(image::floatOfHalf(texel[2]), 0);
  EXPECT_EQ(image::floatOfHalf(texel[3]), 1);
}

TEST(UsedDirections, EveryDirectionInFrontFindsItsThreeTextures) {
  const TriangleMesh cube = boxes::unitCube();
  std::mt19937 random(1);
  for (const int level : {0, 1, 2}) {
    const DirectionMesh mesh(octahedronDirections(level));
    for (const Chart& chart : boxes::faceCharts(cube, 4)) {
      const std::vector<uint8_t> isUsed = usedDirections(cube, chart, mesh);
      const Vec3<double> normal = areaVector(cube, chart.meshTriangles[0]).normalized();
      for (int i = 0; i < 300; ++i) {
        const Vec3<double> r = randomUnit(random);
        if (r.dot(normal) < 0) continue;
        for (const uint32_t direction : mesh.weightsAt(assume<Direction>(r)).directions)
          EXPECT_EQ(isUsed[direction], 1);
      }
    }
  }
}

TEST(UsedDirections, AFlatRegionLeavesOutThoseFarBehindIt) {
  const TriangleMesh cube = boxes::unitCube();
  const DirectionMesh mesh(octahedronDirections(2));
  for (const Chart& chart : boxes::faceCharts(cube, 4)) {
    const std::vector<uint8_t> isUsed = usedDirections(cube, chart, mesh);
    const Vec3<double> normal = areaVector(cube, chart.meshTriangles[0]).normalized();
    for (size_t i = 0; i < isUsed.size(); ++i)
      if (mesh.directions()[i].raw().dot(normal) < -0.6) {
        EXPECT_EQ(isUsed[i], 0);
      } // 37 degrees behind
  }
}

TEST(UsedDirections, AClosedBodyUsesAll) {
  const TriangleMesh cube = boxes::unitCube();
  const DirectionMesh mesh(octahedronDirections(2));
  Chart whole;
  for (uint32_t t = 0; t < cube.triangles.size(); ++t) whole.meshTriangles.push_back(t);
  EXPECT_TRUE(std::ranges::all_of(usedDirections(cube, whole, mesh), [](uint8_t used) { return used == 1; }));
}

TEST(UsedDirections, TrianglesWithoutAreaUseNone) {
  TriangleMesh flat{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}};
  Chart chart;
  chart.meshTriangles = {0};
  const DirectionMesh mesh(octahedronDirections(1));
  EXPECT_TRUE(std::ranges::all_of(usedDirections(flat, chart, mesh), [](uint8_t used) { return used == 0; }));
}

} // namespace

namespace {

constexpr size_t kTexelCount = 8;

// Radiance that is equal in all texels and observed from everywhere.
DirectionalRadiance radianceIn(const DirectionMesh& fine,
                               const std::function<double(const Vec3<double>&)>& of) {
  DirectionalRadiance result;
  for (const Direction& direction : fine.directions()) {
    result.radiance.emplace_back(kTexelCount, Vec3<float>::Constant(static_cast<float>(of(direction.raw()))));
    result.isObserved.emplace_back(kTexelCount, 1);
  }
  return result;
}

DirectionMesh subsetOf(const DirectionMesh& fine, const std::vector<size_t>& kept) {
  std::vector<Direction> directions;
  for (const size_t i : kept) directions.push_back(fine.directions()[i]);
  return DirectionMesh(directions);
}

const Vec3<double> kMirror = Vec3<double>(1, 0.7, 2).normalized();
double highlight(const Vec3<double>& d) { return 0.2 + std::pow(std::max(0.0, d.dot(kMirror)), 30); }

TEST(AdaptiveDirections, AMatteRegionKeepsTheSixOfTheOctahedron) {
  const DirectionMesh fine(octahedronDirections(3));
  const auto kept = adaptedDirections(radianceIn(fine, [](const auto&) { return 0.7; }), fine, 1e-6);
  EXPECT_EQ(kept, (std::vector<size_t>{0, 1, 2, 3, 4, 5}));
}

TEST(AdaptiveDirections, AHighlightKeepsDirectionsNearTheMirrorDirection) {
  const DirectionMesh fine(octahedronDirections(3));
  const auto kept = adaptedDirections(radianceIn(fine, highlight), fine, 0.02);
  EXPECT_GT(kept.size(), 12u);
  EXPECT_LT(kept.size(), 66u);
  const auto share = [&](const auto& isCounted) {
    size_t all = 0, ours = 0;
    for (size_t i = 0; i < fine.directions().size(); ++i)
      if (isCounted(fine.directions()[i].raw().dot(kMirror))) {
        ++all;
        ours += std::ranges::binary_search(kept, i);
      }
    return static_cast<double>(ours) / static_cast<double>(all);
  };
  EXPECT_GT(share([](double cosine) { return cosine > 0.9; }), 0.5);
  EXPECT_LT(share([](double cosine) { return cosine < 0.5; }), 0.1);
}

TEST(AdaptiveDirections, WhatIsLeftOutIsReproducedWithinTheTolerance) {
  const DirectionMesh fine(octahedronDirections(3));
  const DirectionalRadiance radiance = radianceIn(fine, highlight);
  size_t before = fine.directions().size() + 1;
  for (const double tolerance : {0.003, 0.01, 0.03, 0.1}) {
    const auto kept = adaptedDirections(radiance, fine, tolerance);
    for (const double error : reproductionErrors(radiance, fine, kept, subsetOf(fine, kept)))
      EXPECT_LE(error, tolerance);
    EXPECT_LT(kept.size(), before);
    before = kept.size();
  }
}

TEST(AdaptiveDirections, WithoutToleranceEverythingThatBendsIsKept) {
  const DirectionMesh fine(octahedronDirections(1));
  const auto kept = adaptedDirections(radianceIn(fine, highlight), fine, 0);
  for (const double error : reproductionErrors(radianceIn(fine, highlight), fine, kept, subsetOf(fine, kept)))
    EXPECT_EQ(error, 0);
}

TEST(AdaptiveDirections, DirectionsThatNoPhotographIsNearAreNotJudged) {
  const DirectionMesh fine(octahedronDirections(2));
  DirectionalRadiance radiance = radianceIn(fine, highlight);
  for (auto& observed : radiance.isObserved) std::ranges::fill(observed, 0);
  EXPECT_EQ(adaptedDirections(radiance, fine, 1e-6).size(), 6u);
}

TEST(AdaptiveDirections, TheErrorIsTheRootMeanSquareOverObservedTexels) {
  const DirectionMesh fine(octahedronDirections(1));
  DirectionalRadiance radiance = radianceIn(fine, [](const auto&) { return 1.0; });
  constexpr size_t kEdge = 6; // the first direction that is not of the octahedron
  radiance.radiance[kEdge][0] = {4, 1, 1};
  radiance.radiance[kEdge][1] = {1, 5, 1};
  radiance.radiance[kEdge][2] = {900, 1, 1};
  radiance.isObserved[kEdge][2] = 0;
  const std::vector<size_t> kept = {0, 1, 2, 3, 4, 5};
  const auto errors = reproductionErrors(radiance, fine, kept, subsetOf(fine, kept));
  EXPECT_NEAR(errors[kEdge], std::sqrt((9.0 + 16.0) / (3 * (kTexelCount - 1))), 1e-6);
  EXPECT_NEAR(errors[kEdge + 1], 0, 1e-6);
}

} // namespace

} // namespace surflect::slf
