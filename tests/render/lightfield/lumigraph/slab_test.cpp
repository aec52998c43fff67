#include "render/lightfield/lumigraph/slab.h"

#include "render/lightfield/lumigraph/reconstruction.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"
#include "tests/support/random.h"

#include <cmath>
#include <numeric>
#include <random>

namespace surflect::lumigraph {
namespace {

const TriangleMesh kMesh = bumpySphere(0.3);

TEST(Slab, LinesKeepTheirCoordinates) {
  std::mt19937 random(1);
  const Slabs slabs = slabsAround(kMesh, {.nodes = 5, .texels = 100000});
  for (const Slab& slab : slabs)
    for (int n = 0; n < 100; ++n) {
      std::uniform_real_distribution<double> within(0, 1);
      const LineCoordinates told{4 * within(random), 4 * within(random), slab.width * within(random),
                                 slab.height * within(random)};
      const Line line = slab.lineOf(told);
      const double far = std::uniform_real_distribution(0.5, 5.)(random);
      const LineCoordinates found = slab.coordinatesOf(line.origin + far * line.direction, line.origin);
      EXPECT_NEAR(found.s, told.s, 1e-12);
      EXPECT_NEAR(found.t, told.t, 1e-12);
      EXPECT_NEAR(found.u, told.u, 1e-10);
      EXPECT_NEAR(found.v, told.v, 1e-10);
    }
}

TEST(Slab, PlanesAreOnTheViewersSideAndInTheMiddle) {
  const Slabs slabs = slabsAround(kMesh, {.texels = 100000, .distance = 3});
  for (size_t i = 0; i < kSlabs; ++i) {
    const Slab& slab = slabs[i];
    EXPECT_EQ(slab.axis, static_cast<int>(i / 2));
    EXPECT_GT(slab.sign * slab.stPlane, 1.5);
    EXPECT_LT(std::abs(slab.uvPlane), 0.1);
    const auto unit = [](int axis) { return Vec3<double>(Vec3<double>::Unit(axis)); };
    EXPECT_EQ(unit(slab.uAxis()).cross(unit(slab.vAxis())), slab.sign * unit(slab.axis));
  }
}

// Every node that counts for a line to a vertex has the vertex in its picture, at a place between texel
// centres.
TEST(Slab, PicturesHoldEveryPointThatTheirNodesAreAskedFor) {
  std::mt19937 random(2);
  for (const int nodes : {2, 4, 7})
    for (const double overlap : {0., 0.25})
      for (const double distance : {1.3, 8.}) {
        const Slabs slabs =
            slabsAround(kMesh, {.nodes = nodes, .texels = 200000, .distance = distance, .overlap = overlap});
        for (int n = 0; n < 500; ++n) {
          const Point p = kMesh.positions[random() % kMesh.positions.size()].cast<double>();
          const Point viewer = p + assume<Direction>(randomUnit(random));
          for (const Tap& tap : tapsAt(slabs, overlap, p, viewer)) {
            const Slab& slab = slabs[tap.slab];
            const LineCoordinates line = slab.coordinatesOf(p, viewer);
            EXPECT_GE(std::min(line.s, line.t), -1e-9);
            EXPECT_LE(std::max(line.s, line.t), nodes - 1 + 1e-9);
            EXPECT_GE(std::min(tap.u, tap.v), 0.5);
            EXPECT_LE(tap.u, slab.width - 0.5);
            EXPECT_LE(tap.v, slab.height - 0.5);
          }
        }
      }
}

// Points within triangles as large as the object, of which an st grid of many nodes sees nearly one vertex.
TEST(Slab, PicturesHoldThePointsOfLargeTriangles) {
  const TriangleMesh tetrahedron{{{-1, -1, -1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}},
                                 {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  for (const int nodes : {2, 3, 7}) {
    const Slabs slabs = slabsAround(tetrahedron, {.nodes = nodes, .texels = 2000000, .distance = 1.25});
    for (int n = 0; n < 20000; ++n) {
      const auto& triangle = tetrahedron.triangles[random() % 4];
      const double b = share(random), c = (1 - b) * share(random);
      const auto corner = [&](size_t i) {
        return Vec3<double>(tetrahedron.positions[triangle[i]].raw().cast<double>());
      };
      const Point p = assume<Point>(Vec3<double>((1 - b - c) * corner(0) + b * corner(1) + c * corner(2)));
      for (const Tap& tap : tapsAt(slabs, 0.02, p, p + assume<Direction>(randomUnit(random)))) {
        EXPECT_GE(std::min(tap.u, tap.v), 0.5);
        EXPECT_LE(tap.u, slabs[tap.slab].width - 0.5);
        EXPECT_LE(tap.v, slabs[tap.slab].height - 0.5);
      }
    }
  }
}

TEST(Slab, TheQuotaIsUsedButNotExceeded) {
  for (const size_t texels : {20000, 300000, 16617744}) {
    const Slabs slabs = slabsAround(kMesh, {.nodes = 4, .texels = texels});
    size_t sum = 0;
    for (const Slab& slab : slabs) {
      EXPECT_EQ(slab.uvSpacing, slabs[0].uvSpacing);
      sum += slab.texels();
    }
    EXPECT_LE(sum, texels);
    EXPECT_GE(static_cast<double>(sum), 0.9 * static_cast<double>(texels));
  }
}

TEST(Slab, OptionsOutOfRangeAreErrors) {
  EXPECT_THROW(slabsAround(kMesh, {.nodes = 1}), Error);
  EXPECT_THROW(slabsAround(kMesh, {.nodes = 46}), Error);
  EXPECT_THROW(slabsAround(kMesh, {.distance = 1}), Error);
  EXPECT_THROW(slabsAround(kMesh, {.distance = std::nan("")}), Error);
  EXPECT_THROW(slabsAround(kMesh, {.overlap = -0.1}), Error);
  EXPECT_THROW(slabsAround(kMesh, {.texels = 0}), Error);
  EXPECT_THROW(slabsAround(kMesh, {.nodes = 7, .texels = 100}), Error);
  EXPECT_THROW(slabsAround({}, {}), Error);
  EXPECT_THROW(slabsAround({{{1, 2, 3}}, {}}, {}), Error);
  EXPECT_THROW(slabsAround({kMesh.positions, {}}, {}), Error);
}

TEST(SlabWeights, SumToOneAndBelongToSidesThatFaceTheViewer) {
  std::mt19937 random(3);
  for (const double overlap : {0., 0.1, 1.})
    for (int n = 0; n < 1000; ++n) {
      const Vec3<double> towards = 3 * randomUnit(random);
      const auto weights = slabWeights(assume<Direction>(towards), overlap);
      EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.), 1, 1e-12);
      for (size_t i = 0; i < kSlabs; ++i) {
        EXPECT_GE(weights[i], 0);
        const double along = (i % 2 == 0 ? 1 : -1) * towards[static_cast<int>(i / 2)];
        if (weights[i] > 0) {
          EXPECT_GE(along * (1 + overlap), towards.cwiseAbs().maxCoeff() * (1 - 1e-12));
        }
      }
    }
}

TEST(SlabWeights, WithoutOverlapTheLargestComponentTells) {
  for (const Vec3<double>& towards : {Vec3<double>(-2, 1, 1), {-2, 2, 2}, {-2, -2, 0}})
    EXPECT_EQ(slabWeights(assume<Direction>(towards), 0), (std::array<double, 6>{0, 1, 0, 0, 0, 0}));
}

// The least overlaps are below the precision of the weights' quotients.
TEST(SlabWeights, AreFiniteForEveryOverlap) {
  std::mt19937 random(6);
  for (const double overlap : {1e-300, 1e-20, 1e-9, 1e-6, 1e-3})
    for (int n = 0; n < 300; ++n) {
      Vec3<double> towards = randomUnit(random);
      if (n % 3 == 0) towards[1] = towards[0];
      const auto weights = slabWeights(assume<Direction>(towards), overlap);
      EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.), 1, 1e-12);
    }
}

TEST(SlabWeights, ChangeContinuously) {
  std::mt19937 random(4);
  constexpr double kOverlap = 0.2, kStep = 1e-6;
  for (int n = 0; n < 2000; ++n) {
    const Vec3<double> towards = randomUnit(random), moved = towards + kStep * randomUnit(random);
    const auto before = slabWeights(assume<Direction>(towards), kOverlap);
    const auto after = slabWeights(assume<Direction>(moved), kOverlap);
    for (size_t i = 0; i < kSlabs; ++i) EXPECT_NEAR(before[i], after[i], 30 * kStep);
  }
}

} // namespace
} // namespace surflect::lumigraph
