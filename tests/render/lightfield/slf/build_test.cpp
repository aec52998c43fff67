#include "render/lightfield/slf/build.h"

#include "render/lightfield/slf/field_file.h"
#include "srf/image/half_float.h"
#include "tests/support/box_capture.h"

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace surflect::slf {
namespace {

constexpr int kChartSide = 6;
constexpr Rgb kColor{0.25f, 2, 40}; // exact in half floats

Rgb constant(const Vec3<double>&, const Vec3<double>&) { return kColor; }

class Built {
public:
  Built(const TriangleMesh& mesh, const boxes::RadianceAt& radianceAt, const boxes::Shoot& shoot,
        const BuildOptions& options = {.directions = 18, .tolerance = 0})
      : views((boxes::writeCapture(mesh, radianceAt, shoot, folder / "views"), folder / "views")),
        report(
            buildWithCharts(views, boxes::faceCharts(views.mesh(), kChartSide), options, folder / "field")),
        opened(openField(folder / "field")) {}

  std::string texels() const { return readFile(folder / "field" / kTexturesFile); }

  image::TemporaryFolder folder;
  lightfield::Views views;
  BuildReport report;
  OpenedField opened;
};

bool isStored(const std::vector<Texel>& texture) {
  return std::ranges::any_of(texture, [](const Texel& texel) { return texel != Texel{}; });
}

// The region of a face by its normal.
size_t regionFacing(const Field& field, const Vec3<double>& normal) {
  for (size_t region = 0; region < field.regions.size(); ++region)
    if (areaVector(field.mesh, field.regions[region].chart.meshTriangles[0]).normalized().dot(normal) > 0.9)
      return region;
  ADD_FAILURE();
  return 0;
}

TEST(Build, AnObjectOfOneColourHasThatColourInEveryTexel) {
  for (const Blend blend : {Blend::nearest, Blend::ulr, Blend::fitted}) {
    const Built built(boxes::unitCube(), constant, {studio::spiral(24), 32, 0.3},
                      {.directions = 18, .tolerance = 0, .blend = blend});
    const Field& field = built.opened.field;
    ASSERT_EQ(field.regions.size(), 6u);
    size_t stored = 0;
    for (size_t region = 0; region < 6; ++region)
      for (size_t i = 0; i < 18; ++i) {
        const std::vector<Texel> texture = built.opened.textures->read(region, i);
        ASSERT_EQ(texture.size(), size_t{kChartSide * kChartSide});
        if (!isStored(texture)) continue;
        ++stored;
        for (const Texel& texel : texture) {
          EXPECT_NEAR(image::floatOfHalf(texel[0]), kColor.r, 3e-4);
          EXPECT_NEAR(image::floatOfHalf(texel[1]), kColor.g, 2e-3);
          EXPECT_NEAR(image::floatOfHalf(texel[2]), kColor.b, 4e-2);
          EXPECT_TRUE(texel[3] == 0 || texel[3] == image::nearestHalf(1));
        }
      }
    EXPECT_EQ(stored, built.report.texturesStored);
  }
}

TEST(Build, TheReportCountsWhatIsInTheFolder) {
  const Built built(boxes::unitCube(), constant, {studio::spiral(24), 32, 0.3});
  EXPECT_EQ(built.report.photographs, 24u);
  EXPECT_EQ(built.report.regions, 6u);
  EXPECT_EQ(built.report.surfaceTexels, size_t{6 * kChartSide * kChartSide});
  EXPECT_EQ(built.report.textures, size_t{6 * 18});
  EXPECT_LT(built.report.texturesStored, built.report.textures);
  EXPECT_EQ(built.report.texels, built.report.texturesStored * kChartSide * kChartSide);
  EXPECT_EQ(built.texels().size(), built.report.texels * sizeof(Texel));
  EXPECT_EQ(built.report.bytes, built.opened.folder.bytes());
  EXPECT_EQ(built.report.unseenRegions, 0u);
  EXPECT_EQ(built.report.directionMeshes, 1u);
  EXPECT_EQ(built.opened.field.textures(), built.report.textures);
}

TEST(Build, EveryDirectionInFrontOfARegionHasItsTexture) {
  const Built built(boxes::unitCube(), constant, {studio::spiral(24), 32, 0.3});
  const Field& field = built.opened.field;
  for (size_t region = 0; region < field.regions.size(); ++region) {
    const Vec3<double> normal =
        areaVector(field.mesh, field.regions[region].chart.meshTriangles[0]).normalized();
    const auto directions = field.directionsOf(region).directions();
    for (size_t i = 0; i < directions.size(); ++i) {
      const double cosine = directions[i].raw().dot(normal);
      const bool isThere = isStored(built.opened.textures->read(region, i));
      if (cosine >= 0) {
        EXPECT_TRUE(isThere);
      } else if (cosine < -0.9) {
        EXPECT_FALSE(isThere);
      }
    }
  }
}

TEST(Build, HeldOutViewsDoNotCount) {
  boxes::Shoot shoot{studio::spiral(24), 32, 0.3};
  shoot.from.emplace_back(0.1, 0.2, 1);
  shoot.split = [](size_t view) { return view == 24 ? capture::Split::test : capture::Split::train; };
  const auto radiance = [](const Vec3<double>&, const Vec3<double>& towards) {
    const bool isHeldOut = towards.dot(Vec3<double>(0.1, 0.2, 1).normalized()) > 0.99;
    return isHeldOut ? Rgb{9, 9, 9} : kColor;
  };
  const Built with(boxes::unitCube(), radiance, shoot);
  shoot.from.pop_back();
  const Built without(boxes::unitCube(), radiance, shoot);
  EXPECT_EQ(with.texels(), without.texels());
  EXPECT_EQ(with.report.photographs, 24u);
}

TEST(Build, BitsDoNotDependOnTheNumberOfThreads) {
  const auto radiance = [](const Vec3<double>& place, const Vec3<double>& towards) {
    return Rgb{static_cast<float>(1 + place[0]), static_cast<float>(1 + towards[2]), 1};
  };
  for (const double tolerance : {0.0, 0.02}) {
    const BuildOptions options{.directions = 18, .tolerance = tolerance, .blend = Blend::fitted};
    const boxes::Shoot shoot{studio::spiral(24), 32, 0.3};
    const auto contentOf = [&] {
      const Built built(boxes::unitCube(), radiance, shoot, options);
      return std::pair(built.texels(), readFile(built.folder / "field" / kFieldFile));
    };
    const auto many = contentOf();
    const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(contentOf(), many);
  }
}

TEST(Build, TheOrderOfViewsDoesNotMatter) {
  const auto radiance = [](const Vec3<double>& place, const Vec3<double>& towards) {
    return Rgb{static_cast<float>(1 + place[0]), static_cast<float>(1 + towards[2]), 1};
  };
  boxes::Shoot shoot{studio::spiral(25), 32, 0.3};
  const Built before(boxes::unitCube(), radiance, shoot);
  std::ranges::reverse(shoot.from);
  const Built after(boxes::unitCube(), radiance, shoot);
  for (size_t region = 0; region < 6; ++region)
    for (size_t i = 0; i < 18; ++i) {
      const auto a = before.opened.textures->read(region, i), b = after.opened.textures->read(region, i);
      for (size_t texel = 0; texel < a.size(); ++texel)
        for (size_t c = 0; c < 4; ++c)
          EXPECT_NEAR(image::floatOfHalf(a[texel][c]), image::floatOfHalf(b[texel][c]), 1e-3);
    }
}

TEST(Build, ARegionThatNoPhotographSeesIsFilledFromItsNeighboursAndNotObserved) {
  boxes::Shoot shoot{{}, 48, 0.3};
  for (const Vec3<double>& direction : studio::spiral(60))
    if (direction[2] > 0.1) shoot.from.push_back(direction);
  const Built built(boxes::unitCube(), constant, shoot);
  EXPECT_EQ(built.report.unseenRegions, 1u);
  EXPECT_EQ(built.report.blackRegions, 0u);
  const size_t bottom = regionFacing(built.opened.field, {0, 0, -1});
  size_t stored = 0;
  for (size_t i = 0; i < 18; ++i) {
    const auto texture = built.opened.textures->read(bottom, i);
    if (!isStored(texture)) continue;
    ++stored;
    for (const Texel& texel : texture) {
      EXPECT_NEAR(image::floatOfHalf(texel[1]), kColor.g, 2e-3);
      EXPECT_EQ(texel[3], 0);
    }
  }
  EXPECT_GE(stored, 9u);
}

TEST(Build, AnUnseenRegionWithoutSeenNeighboursIsBlackAndCounted) {
  // A small box under a table, photographed from above.
  TriangleMesh mesh;
  boxes::addBox(mesh, {-0.8f, -0.8f, 0}, {0.8f, 0.8f, 0.1f});
  boxes::addBox(mesh, {-0.1f, -0.1f, -0.3f}, {0.1f, 0.1f, -0.1f});
  boxes::Shoot shoot{{{0.1, 0, 1}, {0, 0.2, 1}, {-0.2, -0.1, 1}, {0.2, 0.2, 1}}, 48, 0.3};
  const Built built(mesh, constant, shoot);
  EXPECT_EQ(built.report.blackRegions, 6u);
  EXPECT_GE(built.report.unseenRegions, 7u); // and the table's lower side
}

TEST(Build, AMatteObjectNeedsFewDirections) {
  const auto matte = [](const Vec3<double>& place, const Vec3<double>&) {
    return Rgb{static_cast<float>(1 + place[0]), 1, static_cast<float>(1 + place[1])};
  };
  const boxes::Shoot shoot{studio::spiral(40), 32, 0.3};
  const Built built(boxes::unitCube(), matte, shoot, {.directions = 66, .tolerance = 0.02});
  for (size_t region = 0; region < 6; ++region)
    EXPECT_LE(built.opened.field.directionsOf(region).directions().size(), 18u);
}

// Radiance with a wave in direction: all directions are kept.
TEST(Build, AGlossyObjectHasAboutAsManyDirectionsAsPhotographs) {
  const auto glossy = [](const Vec3<double>&, const Vec3<double>& towards) {
    return Rgb{static_cast<float>(1 + std::sin(9 * towards[0]) * std::cos(8 * towards[1] + towards[2])), 1,
               1};
  };
  for (const auto& [photographs, directions] : {std::pair(24, 18u), {50, 66u}, {200, 258u}}) {
    const Built built(boxes::unitCube(), glossy, {studio::spiral(photographs), 24, 0.3}, {.tolerance = 0});
    EXPECT_EQ(built.report.directions, directions);
    for (size_t region = 0; region < 6; ++region)
      EXPECT_EQ(built.opened.field.directionsOf(region).directions().size(), directions);
    const Built adapted(boxes::unitCube(), glossy, {studio::spiral(photographs), 24, 0.3}, {});
    EXPECT_EQ(adapted.report.directions, directions);
    EXPECT_LE(adapted.report.textures, built.report.textures);
    EXPECT_GT(adapted.report.textures, built.report.textures / 3);
  }
}

TEST(Build, TheNumberOfDirectionsGrowsWithThatOfPhotographs) {
  EXPECT_EQ(directionsFor(0), 18u);
  EXPECT_EQ(directionsFor(34), 18u);
  EXPECT_EQ(directionsFor(35), 66u);
  EXPECT_EQ(directionsFor(130), 66u);
  EXPECT_EQ(directionsFor(131), 258u);
  EXPECT_EQ(directionsFor(100'000), 258u);
}

TEST(Build, ImpossibleOptionsAreRefused) {
  image::TemporaryFolder folder;
  boxes::writeCapture(boxes::unitCube(), constant, {studio::spiral(8), 24, 0.3}, folder / "views");
  const lightfield::Views views(folder / "views");
  const auto errorOf = [&](const BuildOptions& options) {
    return image::errorOf([&] { build(views, options, folder / "field"); });
  };
  EXPECT_EQ(errorOf({.regions = 0}), "regions: found 0, expected at least 1");
  EXPECT_EQ(errorOf({.directions = 67}), "directions: found 67, expected 6, 18, 66, 258 or 1026");
  EXPECT_EQ(errorOf({.tolerance = -1}), "tolerance: found -1, expected a number not below 0");
  EXPECT_EQ(errorOf({.tolerance = NAN}), "tolerance: found nan, expected a number not below 0");
  EXPECT_FALSE(std::filesystem::exists(folder / "field"));
}

TEST(Build, ItCutsAMeshIntoRegionsOfAboutTheWantedTexels) {
  image::TemporaryFolder folder;
  studio::Studio sphere{.cameras = 24, .lights = 0, .size = 40};
  studio::photograph(sphere, folder / "views");
  const lightfield::Views views(folder / "views");
  const BuildReport report =
      build(views, {.regions = 20, .texels = 4000, .directions = 18}, folder / "field");
  EXPECT_EQ(report.regions, 20u);
  EXPECT_LE(report.surfaceTexels, 4400u);
  EXPECT_GE(report.surfaceTexels, 2000u);
  // Radiance of the sphere is that of its normals.
  const OpenedField opened = openField(folder / "field");
  double sum = 0;
  size_t count = 0;
  for (size_t region = 0; region < opened.field.regions.size(); ++region) {
    const Chart& chart = opened.field.regions[region].chart;
    const auto directions = opened.field.directionsOf(region).directions();
    for (size_t i = 0; i < directions.size(); ++i) {
      const auto texture = opened.textures->read(region, i);
      for (size_t v = 0; v < chart.vertices.size(); ++v) {
        const Vec3<float> normal = opened.field.mesh.positions[chart.vertices[v]].raw().normalized();
        if (directions[i].cast<float>().raw().dot(normal) < 0.2f) continue;
        const auto x = static_cast<size_t>(chart.coordinates[v][0] * static_cast<float>(chart.width)),
                   y = static_cast<size_t>(chart.coordinates[v][1] * static_cast<float>(chart.height));
        const Texel& texel = texture[y * static_cast<size_t>(chart.width) + x];
        sum += std::pow(image::floatOfHalf(texel[1]) - studio::fixedRadiance(normal).g, 2);
        ++count;
      }
    }
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(count)), 0.02);
}

} // namespace
} // namespace surflect::slf
