#include "render/lightfield/lfm/build.h"

#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/radiance.h"
#include "tests/render/lightfield/lfm/edge_places.h"
#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

constexpr Rgb kColor{0.25f, 1, 2};

Rgb constant(const Vec3<double>&, const Vec3<double>&) { return kColor; }

// Linear in the direction to the viewer; the same at all points.
Rgb glossy(const Vec3<double>&, const Vec3<double>& d) {
  const Vec3<double> v = d.normalized();
  return {static_cast<float>(0.6 + 0.3 * v.x()), static_cast<float>(0.6 + 0.3 * v.y()),
          static_cast<float>(0.6 + 0.3 * v.z())};
}

// Maps of a cube from 32 photographs.
struct Built {
  explicit Built(const boxes::RadianceAt& radianceAt,
                 const BuildOptions& options = {.samples = 5, .viewSize = 8})
      : views((boxes::writeCapture(boxes::unitCube(), radianceAt, {studio::spiral(32), 36, 0.25},
                                   folder / "views"),
               folder / "views")),
        maps(build(views, options, report)) {}

  image::TemporaryFolder folder;
  lightfield::Views views;
  BuildReport report;
  LightFieldMaps maps;
};

// Calls work(place, direction, radiance of the maps) for random places and directions within 60 degrees of
// the face's normal.
void forRadiance(const LightFieldMaps& maps, const auto& work) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 0.5);
  for (int trial = 0; trial < 300; ++trial) {
    const TrianglePlace place{random() % maps.mesh.triangles.size(), number(random), number(random)};
    const Vec3<double> d = randomUnit(random);
    if (d.dot(areaVector(maps.mesh, place.triangle).normalized()) < 0.5) continue;
    work(place, d, radianceAt(maps, place, assume<Direction>(d), maps.terms.size()));
  }
}

TEST(LfmBuild, AnObjectOfOneColourHasThatColourInAllDirections) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    const Built built(constant, {.method = method, .terms = 2, .samples = 5, .viewSize = 8});
    forRadiance(built.maps, [](const TrianglePlace&, const Vec3<double>&, const Vec3<double>& found) {
      EXPECT_NEAR(found[0], kColor.r, 0.02);
      EXPECT_NEAR(found[1], kColor.g, 0.02);
      EXPECT_NEAR(found[2], kColor.b, 0.02);
    });
    EXPECT_LT(built.report.errors.back().rms(), 2e-3);
  }
}

TEST(LfmBuild, OneTermHasWhatChangesInOneWayWithTheDirection) {
  const Built built(glossy, {.terms = 1, .samples = 5, .viewSize = 16});
  double squares = 0, meanSquares = 0;
  size_t count = 0;
  forRadiance(built.maps, [&](const TrianglePlace& place, const Vec3<double>& d, const Vec3<double>& found) {
    const Rgb truth = glossy({}, d);
    const Vec3<double> expected(truth.r, truth.g, truth.b);
    squares += (found - expected).squaredNorm();
    meanSquares += (meanValue(built.maps, place).cwiseAbs2() - expected).squaredNorm();
    count += 3;
  });
  ASSERT_GT(count, 150u);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.05);
  EXPECT_GT(meanSquares, 10 * squares);
}

TEST(LfmBuild, IsContinuousAcrossEdgesForEveryNumberOfTerms) {
  const auto textured = [](const Vec3<double>& p, const Vec3<double>& d) {
    const Rgb rgb = glossy(p, d);
    const auto wave = static_cast<float>(1.5 + std::sin(9 * p.x()) * std::cos(7 * p.y() + p.z()));
    return Rgb{wave * rgb.r, rgb.g, wave * wave * rgb.b};
  };
  const Built built(textured);
  std::mt19937 random(2);
  size_t terms = 0;
  for (const auto& [a, b] : testing::edgePlaces(built.maps.mesh, random)) {
    const Direction d = assume<Direction>(randomUnit(random));
    for (terms = 0; terms <= built.maps.terms.size(); ++terms) {
      const Vec3<double> one = radianceAt(built.maps, a, d, terms),
                         other = radianceAt(built.maps, b, d, terms);
      EXPECT_LT((one - other).norm(), 1e-9);
    }
  }
  EXPECT_EQ(terms, 4u);
}

TEST(LfmBuild, AToleranceTakesTheTermsThatItNeedsAndNoBytesForOthers) {
  const Built all(glossy, {.terms = 3, .samples = 5, .viewSize = 8});
  const Built few(glossy, {.terms = 16, .tolerance = 0.01, .samples = 5, .viewSize = 8});
  EXPECT_LE(relativeErrors(few.report).back(), 0.01);
  EXPECT_LT(few.report.meanTerms, 3);
  EXPECT_LT(bytesOf(few.maps).total(), bytesOf(all.maps).total());
}

// The middle of a cube's face is a sample.
TEST(LfmBuild, OneBrightSampleLeavesTheOthersTheirCodes) {
  const auto spotted = [](const Vec3<double>& p, const Vec3<double>&) {
    const bool isSpot = p.x() > 0.49 && std::abs(p.y()) < 0.04 && std::abs(p.z()) < 0.04;
    return isSpot ? Rgb{3000, 3000, 3000} : Rgb{0.1f, 0.1f, 0.1f};
  };
  const Built built(spotted);
  EXPECT_FLOAT_EQ(built.maps.meanWhite,
                  static_cast<float>(2 * std::sqrt(built.report.white))); // the spot is brighter
  for (size_t triangle = 0; triangle < built.maps.mesh.triangles.size(); ++triangle)
    if (areaVector(built.maps.mesh, triangle).normalized().x() < -0.9) {
      EXPECT_NEAR(meanValue(built.maps, {triangle, 0.3, 0.3})[0], std::sqrt(0.1), 0.005);
    }
}

TEST(LfmBuild, ReportsSizesAsThePaperCountsThem) {
  const Built built(constant);
  EXPECT_EQ(built.report.resampledBytes, 3u * 12 * 15 * 64);
  EXPECT_LE(built.report.normalizedBytes, 3u * 12 * 15 * 32);
  EXPECT_LT(built.report.unseenRows, built.report.rows);
}

// Photographs from above see no vertex of a cube's bottom, whose sides are seen.
TEST(LfmBuild, VerticesThatNoPhotographSeesAreNotBlack) {
  const image::TemporaryFolder folder;
  boxes::writeCapture(boxes::unitCube(), constant,
                      {{{0.3, 0.2, 1}, {-0.2, 0.3, 1}, {0.1, -0.3, 1}, {-0.3, -0.2, 1}}, 48, 0.25},
                      folder.path());
  const lightfield::Views views(folder.path());
  BuildReport report;
  const LightFieldMaps maps = build(views, {.samples = 5, .viewSize = 8}, report);
  EXPECT_GT(report.unseenRows, 0u);
  for (size_t triangle = 0; triangle < maps.mesh.triangles.size(); ++triangle) {
    const Vec3<double> found = radianceAt(maps, {triangle, 0.3, 0.3}, {0, 0, 1}, 3);
    EXPECT_NEAR(found[1], kColor.g, 0.02) << triangle;
  }
}

TEST(LfmBuild, IsTheSameForAnyNumberOfThreads) {
  const Built built(glossy);
  const std::vector<std::byte> expected = mapsBytes(built.maps);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  BuildReport report;
  EXPECT_EQ(mapsBytes(build(built.views, {.samples = 5, .viewSize = 8}, report)), expected);
}

TEST(LfmBuild, OptionsOutOfRangeAreRefusedAndWorkIsCancelled) {
  const Built built(constant);
  BuildReport report;
  EXPECT_EQ(image::errorOf([&] { build(built.views, {.terms = 65}, report); }),
            "terms: found 65, expected 0..64");
  EXPECT_EQ(image::errorOf([&] { build(built.views, {.method = Factorization::nmf, .terms = 0}, report); }),
            "terms: found 0, expected at least 1 for nmf, which has no mean");
  EXPECT_THROW(build(built.views, {.samples = 1}, report), Error);
  EXPECT_THROW(build(built.views, {.viewSize = 1}, report), Error);
  const Progress stop{.report = {}, .cancelled = [] { return true; }};
  EXPECT_THROW(build(built.views, {}, report, stop), Cancelled);
}

} // namespace
} // namespace surflect::lfm
