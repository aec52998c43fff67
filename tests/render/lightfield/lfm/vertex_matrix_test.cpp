#include "render/lightfield/lfm/vertex_matrix.h"

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/factorization.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/view_blend.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

using Point = Point3<AcquisitionSpace, double>;
using slf::testing::meshOf;

// Radiance that leaves a place in a direction.
using Radiance = std::function<Vec3<double>(const Vec3<double>& place, const Vec3<double>& d)>;

constexpr int kPerEdge = 5, kSize = 8;

// Cameras at distance 4 from the origin.
std::vector<Vec3<double>> camerasAround(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Vec3<double>> cameras;
  for (size_t i = 0; i < count; ++i) cameras.push_back(4 * randomUnit(random));
  return cameras;
}

// Cameras within 55 degrees of +z.
std::vector<Vec3<double>> camerasAbove(size_t count, unsigned seed) {
  std::vector<Vec3<double>> cameras;
  for (const Vec3<double>& camera : camerasAround(20 * count, seed))
    if (camera.z() > 4 * 0.57 && cameras.size() < count) cameras.push_back(camera);
  return cameras;
}

// A mesh with an analytic light field, seen from the front of each triangle by every camera.
struct Scene {
  TriangleMesh mesh;
  std::vector<Vec3<double>> cameras;
  Radiance radiance;
  Rings rings{mesh};
  SeenLightField field{mesh, rings, PatchGrid(kPerEdge), ViewGrid(kSize),
                       [this](uint32_t triangle, const Point& p) { return observe(triangle, p); }};

  // Whether a camera is hidden from a point.
  std::function<bool(uint32_t camera, const Vec3<double>& p)> hides = [](uint32_t, const Vec3<double>&) {
    return false;
  };

  std::vector<Observation> observe(uint32_t triangle, const Point& p) const {
    std::vector<Observation> seen;
    for (uint32_t i = 0; i < cameras.size(); ++i) {
      const Vec3<double> d = (cameras[i] - p.raw()).normalized();
      if (areaVector(mesh, triangle).dot(d) > 0 && !hides(i, p.raw()))
        seen.push_back({i, assume<Direction3<AcquisitionSpace>>(d), radiance(p.raw(), d).cast<float>(), 1});
    }
    return seen;
  }
  Vec3<double> place(uint32_t vertex, const RingRows& rows, size_t row) const {
    const auto& [r, sample] = rows.of(row)[0];
    const auto& corners = rings.corners()[rings.around(vertex)[r].triangle];
    Vec3<double> sum = Vec3<double>::Zero();
    for (size_t k = 0; k < 3; ++k)
      sum += field.patch.barycentrics(sample)[static_cast<int>(k)] *
             mesh.positions[corners[k]].raw().cast<double>();
    return sum;
  }
};

// Value of a row in a cell of the grid, and how well it was observed there.
double valueIn(const VertexMatrix& matrix, size_t row, size_t cell, size_t channel) {
  const CellBlend& blend = matrix.cells[cell];
  double sum = 0;
  for (size_t k = 0; k < 3; ++k)
    sum += static_cast<double>(blend.weights[k] * matrix.value(row, blend.sites[k], channel));
  return sum;
}
double weightIn(const VertexMatrix& matrix, const ViewGrid& grid, size_t row, size_t cell) {
  const CellBlend& blend = matrix.cells[cell];
  double sum = 0;
  for (size_t k = 0; k < 3; ++k)
    sum += static_cast<double>(blend.weights[k] * matrix.weights[row * matrix.sites + blend.sites[k]]);
  return blend.isObserved && grid.isInDisc(cell) ? sum : 0;
}

// Radiance in a cell, without the hat function of its row.
double radianceIn(const VertexMatrix& matrix, const RingRows& rows, size_t row, size_t cell, size_t channel) {
  return radianceOf(valueIn(matrix, row, cell, channel) / static_cast<double>(rows.hats[row]));
}

Vec3<double> colorAt(const Vec3<double>& p) { return {2 + p[0], 1 + p[1] * p[2], std::exp(p[2])}; }

TEST(VertexMatrix, AConstantLightFieldIsItsRootTimesTheHatFunctionInEveryCell) {
  const Scene scene{slf::testing::bumpySphere(6, 8), camerasAround(60, 1),
                    [](const Vec3<double>&, const Vec3<double>&) { return Vec3<double>(0.25, 1, 3); }};
  for (const uint32_t v : scene.rings.vertices()) {
    const VertexMatrix matrix = matrixOf(scene.field, v);
    const RingRows rows = ringRows(scene.rings, v, scene.field.patch);
    ASSERT_EQ(matrix.rows, rows.rows());
    for (size_t row = 0; row < matrix.rows; ++row)
      for (size_t cell = 0; cell < matrix.cells.size(); ++cell) {
        EXPECT_NEAR(valueIn(matrix, row, cell, 0), 0.5f * rows.hats[row], 1e-6);
        EXPECT_NEAR(valueIn(matrix, row, cell, 2), std::sqrt(3.f) * rows.hats[row], 1e-6);
      }
  }
}

TEST(VertexMatrix, OfATrianglesCornersSumToItsRootWhereThisHasNoDirection) {
  const Scene scene{slf::testing::bumpySphere(5, 6, 0.1), camerasAround(60, 2),
                    [](const Vec3<double>& p, const Vec3<double>&) { return colorAt(p); }};
  const size_t samples = scene.field.patch.samples();
  std::vector<Vec3<double>> sums(scene.mesh.triangles.size() * samples, Vec3<double>::Zero());
  const size_t cell = 21;
  for (const uint32_t v : scene.rings.vertices()) {
    const VertexMatrix matrix = matrixOf(scene.field, v);
    const RingRows rows = ringRows(scene.rings, v, scene.field.patch);
    for (size_t i = 0; i < rows.rowOf.size(); ++i)
      for (size_t c = 0; c < 3 && rows.rowOf[i] != RingRows::kNone; ++c)
        sums[scene.rings.around(v)[i / samples].triangle * samples + i % samples][static_cast<int>(c)] +=
            valueIn(matrix, rows.rowOf[i], cell, c);
  }
  for (size_t t = 0; t < scene.mesh.triangles.size(); ++t)
    for (size_t s = 0; s < samples; ++s) {
      Vec3<double> place = Vec3<double>::Zero();
      for (size_t k = 0; k < 3; ++k)
        place += scene.field.patch.barycentrics(s)[static_cast<int>(k)] *
                 scene.mesh.positions[scene.rings.corners()[t][k]].raw().cast<double>();
      EXPECT_LT((sums[t * samples + s].cwiseAbs2() - colorAt(place)).norm(), 4e-6);
    }
}

// Sites in the hull of each row's photographs: those near the border are beyond it from some places.
TEST(VertexMatrix, ARootThatIsLinearOnTheDiscIsExactWellWithinTheHullOfTheViews) {
  Scene scene{slf::testing::squarePatch(2), camerasAbove(200, 3), {}};
  const uint32_t v = 4; // the middle
  const VertexFrame& frame = scene.rings.frame(v);
  scene.radiance = [&](const Vec3<double>& p, const Vec3<double>& d) -> Vec3<double> {
    const Vec3<double> root = Vec3<double>(3, 4, 2) + colorAt(p) + d.dot(frame.x) * Vec3<double>(1, -2, 0.5) +
                              d.dot(frame.y) * Vec3<double>(0, 1, 3);
    return root.cwiseAbs2();
  };
  const VertexMatrix matrix = matrixOf(scene.field, v);
  const RingRows rows = ringRows(scene.rings, v, scene.field.patch);
  size_t checked = 0;
  for (size_t row = 0; row < matrix.rows; ++row)
    for (size_t cell = 0; cell < matrix.cells.size(); ++cell) {
      const DiscPoint center = scene.field.views.center(cell);
      if ((center - DiscPoint(0.5, 0.5)).norm() > 0.25) continue; // the hull reaches 0.4
      const Vec3<double> d = directionAt(frame, center).raw();
      const Vec3<double> expected = scene.radiance(scene.place(v, rows, row), d);
      for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(std::sqrt(radianceIn(matrix, rows, row, cell, c)),
                    std::sqrt(expected[static_cast<int>(c)]), 4e-6);
      EXPECT_NEAR(weightIn(matrix, scene.field.views, row, cell), 1, 2e-7);
      ++checked;
    }
  EXPECT_EQ(checked, matrix.rows * 12);
}

TEST(VertexMatrix, WeightsAreZeroOutsideTheDiscAndFarFromTheViews) {
  const Scene scene{slf::testing::squarePatch(2), camerasAbove(40, 4),
                    [](const Vec3<double>& p, const Vec3<double>&) { return colorAt(p); }};
  const VertexMatrix matrix = matrixOf(scene.field, 4);
  for (size_t cell = 0; cell < matrix.cells.size(); ++cell) {
    const double radius = (scene.field.views.center(cell) - DiscPoint(0.5, 0.5)).norm();
    // The views are within sin(55 degrees) / 2 and the parallax of the patch; a cell is 1 / 8 wide.
    if (radius > 0.5) {
      EXPECT_EQ(weightIn(matrix, scene.field.views, 0, cell), 0);
    } else if (radius < 0.3) {
      EXPECT_GT(weightIn(matrix, scene.field.views, 0, cell), 0);
    }
  }
}

TEST(VertexMatrix, ASharedEdgeIsSeenByTheCamerasOfBothTriangles) {
  // A roof whose sides face away from each other's camera.
  const Scene scene{meshOf({{0, -1, 0}, {0, 1, 0}, {0.2, 0, -1}, {-0.2, 0, -1}}, {{0, 2, 1}, {0, 1, 3}}),
                    {{4, 0, 0}, {-4, 0, 0}},
                    [](const Vec3<double>&, const Vec3<double>& d) {
                      return d[0] > 0 ? Vec3<double>(1, 1, 1) : Vec3<double>(2, 2, 2);
                    }};
  const VertexMatrix matrix = matrixOf(scene.field, 0);
  const RingRows rows = ringRows(scene.rings, 0, scene.field.patch);
  for (size_t row = 0; row < matrix.rows; ++row) {
    double low = 9, high = 0;
    for (size_t cell = 0; cell < matrix.cells.size(); ++cell) {
      low = std::min(low, radianceIn(matrix, rows, row, cell, 0));
      high = std::max(high, radianceIn(matrix, rows, row, cell, 0));
    }
    if (rows.of(row).size() == 2) {
      EXPECT_LT(low, 1.2);
      EXPECT_GT(high, 1.8);
    } else {
      EXPECT_NEAR(low, high, 1e-6);
    }
  }
}

TEST(VertexMatrix, AViewThatMissesOneSampleCountsForTheOthersOrForNone) {
  Scene scene{slf::testing::squarePatch(1), camerasAbove(12, 5),
              [](const Vec3<double>&, const Vec3<double>&) { return Vec3<double>(1, 1, 1); }};
  // Cameras 0 to 2 do not see the corner at (1, 0, 0), which is in one of the two triangles.
  scene.hides = [](uint32_t camera, const Vec3<double>& p) { return camera < 3 && p[0] - p[1] > 0.9; };
  const auto inner = [&](Visible visible) {
    scene.field.visible = visible;
    scene.field.observe = [&](uint32_t triangle, const Point& p) {
      std::vector<Observation> seen = scene.observe(triangle, p);
      for (Observation& o : seen) o.radiance = Vec3<float>::Constant(o.photograph < 3 ? 2.f : 1.f);
      return seen;
    };
    const VertexMatrix matrix = matrixOf(scene.field, 0);
    EXPECT_EQ(matrix.triangleViews, 9u + 12u);
    // An inner sample of the first triangle, beside which no other row shows.
    const RingRows rows = ringRows(scene.rings, 0, scene.field.patch);
    const uint32_t row = rows.rowOf[scene.field.patch.index({1, 1})];
    double highest = 0;
    for (size_t cell = 0; cell < matrix.cells.size(); ++cell)
      highest = std::max(highest, radianceIn(matrix, rows, row, cell, 0));
    return highest;
  };
  EXPECT_NEAR(inner(Visible::triangle), 1, 1e-6);
  EXPECT_GT(inner(Visible::sample), 1.5);
}

TEST(VertexMatrix, UnseenRowsAreFilledFromTheRowsAroundThem) {
  Scene scene{slf::testing::squarePatch(2), camerasAbove(20, 6),
              [](const Vec3<double>& p, const Vec3<double>&) { return Vec3<double>(1 + p[0], 1, 1); }};
  scene.hides = [](uint32_t, const Vec3<double>& p) { return (p - Vec3<double>(0.5, 0.5, 0)).norm() < 0.2; };
  const VertexMatrix matrix = matrixOf(scene.field, 4);
  const RingRows rows = ringRows(scene.rings, 4, scene.field.patch);
  EXPECT_GT(matrix.unseenRows, 4u);
  EXPECT_LT(matrix.unseenRows, matrix.rows);
  for (size_t row = 0; row < matrix.rows; ++row) {
    const Vec3<double> p = scene.place(4, rows, row);
    const bool isSeen = !scene.hides(0, p);
    EXPECT_EQ(weightIn(matrix, scene.field.views, row, 27) > 0, isSeen);
    // Seen samples next to the hole are at most 0.2 + 1/8 from its middle.
    EXPECT_NEAR(radianceIn(matrix, rows, row, 27, 0), 1 + p[0], isSeen ? 1e-6 : 0.35);
    EXPECT_NEAR(radianceIn(matrix, rows, row, 27, 1), 1, 1e-6);
  }
}

TEST(VertexMatrix, ARingThatNoViewSeesHasNoSite) {
  const Scene scene{slf::testing::squarePatch(2), {{0, 0, -4}}, [](const Vec3<double>&, const Vec3<double>&) {
                      return Vec3<double>(1, 1, 1);
                    }};
  const VertexMatrix matrix = matrixOf(scene.field, 4);
  EXPECT_EQ(matrix.unseenRows, matrix.rows);
  EXPECT_EQ(matrix.triangleViews, 0u);
  EXPECT_EQ(matrix.sites, 0u);
}

TEST(VertexMatrix, AViewThatFadesLeavesTheBlendsOneAfterAnother) {
  Scene scene{slf::testing::squarePatch(1), camerasAbove(30, 7), {}};
  const size_t cell = 36;
  const Vec3<double> towards =
      directionAt(scene.rings.frame(0), scene.field.views.center(cell)).raw(); // of camera 30
  const std::vector<std::pair<float, float>> shareOfFade{
      {1.f, 1.f}, {0.5f, 0.75f}, {0.2f, 0.5f}, {0.05f, 0.25f}, {0.005f, 0.f}};
  for (const auto& [fade, share] : shareOfFade) {
    scene.field.observe = [&](uint32_t, const Point& p) {
      std::vector<Observation> seen;
      for (uint32_t i = 0; i < 30; ++i)
        seen.push_back({i, assume<Direction3<AcquisitionSpace>>((scene.cameras[i] - p.raw()).normalized()),
                        Vec3<float>::Constant(1), 1});
      seen.push_back({30, assume<Direction3<AcquisitionSpace>>(towards), Vec3<float>::Constant(5), fade});
      return seen;
    };
    const VertexMatrix matrix = matrixOf(scene.field, 0);
    const double root =
        std::sqrt(radianceIn(matrix, ringRows(scene.rings, 0, scene.field.patch), 0, cell, 0));
    EXPECT_NEAR(root, 1 + (std::sqrt(5.0) - 1) * double{share}, 1e-5);
    EXPECT_NEAR(weightIn(matrix, scene.field.views, 0, cell), 1, 1e-6);
  }
}

// Factors of sites against those of all cells, by their errors in cells.
TEST(VertexMatrix, TermsOfSitesAreNearlyTheBestForCells) {
  const Scene scene{slf::testing::bumpySphere(6, 8), camerasAround(60, 10),
                    [](const Vec3<double>& p, const Vec3<double>& d) -> Vec3<double> {
                      const double gloss = std::pow(std::max(0.0, d.dot(p.normalized())), 8);
                      return (2 + std::sin(7 * p[0]) + gloss * std::cos(5 * p[1])) * colorAt(p);
                    }};
  FactorError ofSites, ofCells, ofMean;
  for (const uint32_t v : scene.rings.vertices()) {
    const VertexMatrix matrix = matrixOf(scene.field, v);
    std::vector<float> values, weights;
    for (size_t row = 0; row < matrix.rows; ++row)
      for (size_t cell = 0; cell < matrix.cells.size(); ++cell) {
        for (size_t c = 0; c < 3; ++c) values.push_back(static_cast<float>(valueIn(matrix, row, cell, c)));
        weights.push_back(static_cast<float>(weightIn(matrix, scene.field.views, row, cell)));
      }
    const LightFieldMatrix inSites{matrix.rows, matrix.sites,      matrix.values, matrix.weights,
                                   3,           matrix.siteWeights},
        whole{matrix.rows, matrix.cells.size(), values, weights};
    Factors factors = factorized(inSites, {.terms = 2, .leastWeight = kLeastWeight});
    for (FactorTerm& term : factors.terms) term.view = inCells(matrix.cells, term.view, 3);
    factors.cells = matrix.cells.size();
    const Factors best = factorized(whole, {.terms = 2, .leastWeight = kLeastWeight});
    const auto add = [&](FactorError& sum, const Factors& of, size_t terms) {
      const FactorError error = errorOf(of, terms, whole);
      sum.squares += error.squares, sum.weight += error.weight;
    };
    add(ofSites, factors, 2), add(ofCells, best, 2), add(ofMean, best, 0);
  }
  EXPECT_GT(ofMean.rms(), 2 * ofCells.rms());
  EXPECT_LT(ofSites.rms(), 1.035 * ofCells.rms()); // 1.9 % above
}

TEST(VertexMatrix, AFaintViewCountsOnlyWhereFewAreClear) {
  Scene scene{slf::testing::squarePatch(1), camerasAbove(10, 8), {}};
  for (const uint32_t clear : {2u, 3u}) {
    scene.field.observe = [&](uint32_t, const Point& p) {
      std::vector<Observation> seen;
      for (uint32_t i = 0; i < 10; ++i) {
        const bool isClear = i < clear;
        seen.push_back({i, assume<Direction3<AcquisitionSpace>>((scene.cameras[i] - p.raw()).normalized()),
                        Vec3<float>::Constant(isClear ? 1.f : 5.f), isClear ? 1.f : 1e-3f});
      }
      return seen;
    };
    const VertexMatrix matrix = matrixOf(scene.field, 0);
    const RingRows rows = ringRows(scene.rings, 0, scene.field.patch);
    double highest = 0;
    for (size_t cell = 0; cell < matrix.cells.size(); ++cell)
      highest = std::max(highest, radianceIn(matrix, rows, 0, cell, 0));
    EXPECT_NEAR(highest, clear < 3 ? 5 : 1, 1e-5);
  }
}

TEST(Patches, AreObservedOnceAndDroppedWhenAllCornersAreReleased) {
  Scene scene{slf::testing::squarePatch(2), camerasAbove(3, 9),
              [](const Vec3<double>&, const Vec3<double>&) { return Vec3<double>(1, 1, 1); }};
  std::atomic<size_t> observed = 0;
  scene.field.observe = [&](uint32_t triangle, const Point& p) {
    ++observed;
    return scene.observe(triangle, p);
  };
  Patches patches(scene.field);
  const size_t triangles = scene.mesh.triangles.size();
  for (const uint32_t& vertex : scene.rings.vertices()) patches.observe({&vertex, 1});
  EXPECT_EQ(patches.held(), triangles);
  EXPECT_EQ(observed, triangles * scene.field.patch.samples());
  for (const uint32_t& vertex : scene.rings.vertices()) {
    const size_t before = patches.held();
    patches.release({&vertex, 1});
    EXPECT_LE(patches.held(), before);
  }
  EXPECT_EQ(patches.held(), 0u);
}

TEST(VertexMatrix, SizesAreThoseOfThePaper) {
  EXPECT_EQ(resampledBytes(6531, 314, 1024), 3ull * 6531 * 314 * 1024);
  EXPECT_EQ(normalizedBytes(100, 300), 90'000u);
}

} // namespace

namespace {

const Vec3<float> kRingRoot(0.5f, 1, 2);

TEST(UnseenVertices, AConstantMatrixIsItsRootTimesTheHatFunctionAndUnobserved) {
  const Rings rings(slf::testing::squarePatch(2));
  const RingRows rows = ringRows(rings, 4, PatchGrid(5));
  const VertexMatrix matrix = constantMatrix(rows, 16, kRingRoot);
  EXPECT_EQ(matrix.unseenRows, matrix.rows);
  for (size_t row = 0; row < matrix.rows; ++row) {
    EXPECT_EQ(valueIn(matrix, row, 7, 2), 2 * rows.hats[row]);
    EXPECT_EQ(matrix.weights[row], 0);
  }
  EXPECT_EQ(meanRoot(matrix, rows), Vec3<float>(0, 0, 0));
}

TEST(UnseenVertices, TheMeanCountsObservedEntriesByTheGridThatTheyStandFor) {
  const Rings rings(slf::testing::squarePatch(2));
  const RingRows rows = ringRows(rings, 4, PatchGrid(5));
  VertexMatrix matrix = constantMatrix(rows, 16, kRingRoot);
  matrix.sites = 3;
  matrix.siteWeights = {0.5f, 1, 0.25f};
  matrix.values.clear(), matrix.weights.clear();
  for (size_t row = 0; row < matrix.rows; ++row) {
    for (const float factor : {1.f, 1000.f, 4.f})
      for (const float root : kRingRoot) matrix.values.push_back(rows.hats[row] * factor * root);
    matrix.weights.insert(matrix.weights.end(), {0.5f, 0, 1});
  }
  EXPECT_LT((meanRoot(matrix, rows) - 2.5f * kRingRoot).norm(), 2e-6);
}

TEST(UnseenVertices, RootsSpreadFromSeenVerticesOutwards) {
  // A row of five squares, and a triangle apart.
  std::vector<Vec3<double>> positions;
  slf::testing::Triangles triangles;
  for (uint32_t i = 0; i < 6; ++i) {
    positions.emplace_back(i, 0, 0);
    positions.emplace_back(i, 1, 0);
  }
  for (uint32_t a = 0; a < 10; a += 2) {
    triangles.push_back({a, a + 2, a + 3});
    triangles.push_back({a, a + 3, a + 1});
  }
  TriangleMesh mesh = slf::testing::meshOf(positions, triangles);
  mesh = slf::testing::together(mesh, slf::testing::meshOf({{9, 0, 0}, {9, 1, 0}, {9, 0, 1}}, {{0, 1, 2}}));
  const Rings rings(mesh);
  std::vector<uint8_t> isSeen(15, 0);
  std::vector<Vec3<float>> roots(15, Vec3<float>::Zero());
  for (const uint32_t v : {0u, 1u}) isSeen[v] = 1, roots[v] = kRingRoot;
  for (const uint32_t v : {10u, 11u}) isSeen[v] = 1, roots[v] = 3 * kRingRoot;
  spreadToUnseen(rings, isSeen, roots);
  for (const uint32_t v : {2u, 3u}) EXPECT_LT((roots[v] - kRingRoot).norm(), 1e-6);
  for (const uint32_t v : {8u, 9u}) EXPECT_LT((roots[v] - 3 * kRingRoot).norm(), 1e-6);
  for (const uint32_t v : {12u, 13u, 14u}) EXPECT_EQ(roots[v], Vec3<float>(0, 0, 0));
  EXPECT_EQ(roots[0], kRingRoot);
}

TEST(MapSizes, AVertexHasAsManyTermsAsSamplesOrDirections) {
  const TriangleMesh mesh = slf::testing::bumpySphere(8, 10);
  const Rings rings(mesh);
  size_t ring = 0;
  for (const uint32_t vertex : rings.vertices()) ring = std::max(ring, rings.around(vertex).size());
  EXPECT_EQ(mostTerms(rings, {.samples = 2, .viewSize = 8}), ring); // one sample of each triangle
  EXPECT_EQ(mostTerms(rings, {.samples = 3, .viewSize = 8}), 3 * ring);
  EXPECT_EQ(mostTerms(rings, {.samples = 100, .viewSize = 2}), 3u * 4); // directions and channels
}

TEST(MapSizes, SizesThatDoNotFitIntoMemoryAreRefusedBeforeWork) {
  const TriangleMesh mesh = slf::testing::bumpySphere(8, 10);
  const Rings rings(mesh);
  requireMemoryFor(rings, {.samples = 24, .viewSize = 32, .terms = 5});
  const std::string error =
      image::errorOf([&] { requireMemoryFor(rings, {.samples = 4096, .viewSize = 256, .terms = 5}); });
  EXPECT_TRUE(error.starts_with("samples 4096 and view_size 256: needs ")) << error;
  EXPECT_NE(error.find(", but this process may use "), std::string::npos) << error;
}

} // namespace

} // namespace surflect::lfm
