#include "render/lightfield/lfm/radiance.h"

#include "render/lightfield/lfm/map_shape.h"
#include "tests/render/lightfield/lfm/edge_places.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

TEST(PatchBlend, ReproducesLinearFunctions) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 1);
  for (const int n : {2, 3, 7, 24})
    for (int trial = 0; trial < 2000; ++trial) {
      double b = number(random), c = number(random);
      if (b + c > 1) b = 1 - b, c = 1 - c;
      if (trial % 4 == 0) b = std::floor(b * (n - 1)) / (n - 1); // on a line of the grid
      if (trial % 4 == 1) c = 1 - b;                             // on an edge
      const PatchBlend blend = blendAt(n, b, c);
      double u = 0, v = 0, sum = 0;
      for (size_t k = 0; k < 3; ++k) {
        ASSERT_GE(blend.weights[k], -1e-12);
        ASSERT_GE(blend.places[k].i, 0);
        ASSERT_GE(blend.places[k].j, 0);
        ASSERT_LT(blend.places[k].i + blend.places[k].j, n);
        u += blend.weights[k] * blend.places[k].i, v += blend.weights[k] * blend.places[k].j;
        sum += blend.weights[k];
      }
      ASSERT_NEAR(sum, 1, 1e-12);
      ASSERT_NEAR(u, b * (n - 1), 1e-11);
      ASSERT_NEAR(v, c * (n - 1), 1e-11);
    }
}

TEST(PatchBlend, PlacesBesideTheTriangleCountAsOnItsEdge) {
  for (const auto& [b, c] :
       {std::array{-0.1, 0.5}, {0.5, -1e-9}, {0.7, 0.4}, {1.2, 0.0}, {0.0, 1.0 + 1e-9}}) {
    const PatchBlend blend = blendAt(5, b, c);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GE(blend.weights[k], -1e-12);
      EXPECT_LE(blend.places[k].i + blend.places[k].j, 4);
    }
  }
}

TEST(PatchBlend, TurningThriceReturnsAndTurnsTheCorners) {
  const int n = 6;
  EXPECT_EQ(turned(n, {5, 0}, 1), (PatchPlace{0, 0})); // corner 1 comes first
  EXPECT_EQ(turned(n, {0, 5}, 2), (PatchPlace{0, 0}));
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n - j; ++i) {
      const PatchPlace place{i, j};
      EXPECT_EQ(turned(n, place, 0), place);
      EXPECT_EQ(turned(n, turned(n, turned(n, place, 1), 1), 1), place);
      EXPECT_EQ(turned(n, turned(n, place, 1), 2), place);
    }
}

TEST(LightFieldMaps, AreContinuousAcrossEdgesForEveryNumberOfTerms) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf})
    for (const bool isScalar : {false, true}) {
      LightFieldMaps maps = syntheticMaps(bumpySphere(5, 7, 0.1), {.method = method, .samples = 5});
      if (isScalar) {
        for (Term& term : maps.terms) term.surface = scalarTable(term.surface, maps.samples);
        maps.layout = SurfaceLayout::scalar;
      }
      std::mt19937 random(2);
      const std::vector<EdgePlace> places = edgePlaces(maps.mesh, random);
      ASSERT_GT(places.size(), 400u);
      for (const auto& [a, b] : places) {
        const Direction d = assume<Direction>(randomUnit(random));
        for (size_t terms = 0; terms <= maps.terms.size(); ++terms)
          ASSERT_LT((radianceAt(maps, a, d, terms) - radianceAt(maps, b, d, terms)).norm(), 1e-12);
      }
    }
}

TEST(LightFieldMaps, OnAnEdgeTheOppositeCornerDoesNotCount) {
  const LightFieldMaps maps = syntheticMaps(bumpySphere(4, 6), {.samples = 5});
  std::mt19937 random(6);
  const std::vector<EdgePlace> places = edgePlaces(maps.mesh, random);
  for (size_t corner = 0; corner < 3; ++corner) {
    LightFieldMaps changed = maps;
    std::vector<uint8_t>& bytes = changed.terms[0].surface.maps.data;
    for (size_t i = corner; i < bytes.size(); i += 3) bytes[i] ^= 0x55;
    size_t checked = 0;
    for (const auto& [place, other] : places) {
      if (Vec3<double>(1 - place.b - place.c, place.b, place.c)[static_cast<int>(corner)] > 1e-12) continue;
      const Direction d = assume<Direction>(randomUnit(random));
      ASSERT_LT((radianceAt(maps, place, d, 3) - radianceAt(changed, place, d, 3)).norm(), 1e-12);
      ++checked;
    }
    EXPECT_GT(checked, 20u);
  }
}

TEST(PatchGrid, BesideTheFarEdgeIsAStepNearerToTheCorner) {
  for (const int n : {2, 3, 6}) {
    const PatchGrid grid(n);
    for (size_t sample = 0; sample < grid.samples(); ++sample)
      for (size_t corner = 0; corner < 3; ++corner) {
        const std::array<int, 3> from = grid.steps(sample);
        if (from[corner] > 0) continue;
        const std::array<int, 3> to = grid.steps(grid.besideFarEdge(sample, corner));
        int moved = 0;
        for (size_t k = 0; k < 3; ++k) moved += std::abs(to[k] - from[k]);
        EXPECT_EQ(to[corner], 1);
        EXPECT_EQ(moved, 2);
      }
  }
}

TEST(LightFieldMaps, MapsThatCountNowhereTakeNoBytes) {
  LightFieldMaps maps = syntheticMaps(bumpySphere(4, 6), {.terms = 4});
  const auto& [a, b, c] = maps.mesh.triangles[7];
  for (const uint32_t vertex : {a, b, c}) maps.terms[1].scale[vertex] = 0;
  std::ranges::fill(maps.terms[3].scale, 0.f);
  const LightFieldMaps fewer = withoutZeros(maps);
  EXPECT_NO_THROW(requireComplete(fewer));
  EXPECT_EQ(fewer.terms.size(), 3u);
  EXPECT_EQ(fewer.terms[1].view.maps.count, maps.mesh.positions.size() - 3);
  EXPECT_EQ(fewer.terms[1].surface.maps.count, maps.mesh.triangles.size() - 1);
  EXPECT_LT(bytesOf(fewer).total(), bytesOf(maps).total());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(0, 0.5);
  for (size_t triangle = 0; triangle < maps.mesh.triangles.size(); ++triangle) {
    const TrianglePlace place{triangle, number(random), number(random)};
    const Direction d = assume<Direction>(randomUnit(random));
    EXPECT_EQ(radianceAt(fewer, place, d, 4), radianceAt(maps, place, d, 4));
  }
}

TEST(LightFieldMaps, ScalarMapsHaveTheValuesOfPackedOnes) {
  const LightFieldMaps packed = syntheticMaps(bumpySphere(4, 6));
  LightFieldMaps scalar = packed;
  for (Term& term : scalar.terms) term.surface = scalarTable(term.surface, scalar.samples);
  scalar.layout = SurfaceLayout::scalar;
  EXPECT_EQ(bytesOf(scalar).total(), bytesOf(packed).total());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(0, 0.5);
  for (int trial = 0; trial < 500; ++trial) {
    const TrianglePlace place{random() % packed.mesh.triangles.size(), number(random), number(random)};
    const Direction d = assume<Direction>(randomUnit(random));
    ASSERT_LT((radianceAt(packed, place, d, 3) - radianceAt(scalar, place, d, 3)).norm(), 1e-14);
  }
}

// Closed form: maps that are linear in place and direction.
TEST(LightFieldMaps, LinearMapsAreReproduced) {
  const int n = 5, size = 16;
  TriangleMesh mesh = squarePatch(1);
  std::vector<VertexFrame> frames = framesOf(mesh);
  LightFieldMaps maps = emptyMaps(std::move(mesh), std::move(frames), Factorization::pca, n, size, 1);
  const PatchGrid grid(n);
  Term& term = maps.terms[0];
  for (size_t t = 0; t < 2; ++t)
    for (size_t sample = 0; sample < grid.samples(); ++sample)
      for (size_t corner = 0; corner < 3; ++corner)
        term.surface.maps.data[3 * (t * grid.samples() + sample) + corner] = 120;
  for (size_t v = 0; v < 4; ++v) {
    term.scale[v] = 2;
    for (size_t cell = 0; cell < size_t{size} * size; ++cell) {
      term.view.maps.data[3 * (v * size * size + cell)] = static_cast<uint8_t>(7 * (cell % size));
      term.view.maps.data[3 * (v * size * size + cell) + 1] = static_cast<uint8_t>(7 * (cell / size));
    }
  }
  std::mt19937 random(4);
  std::uniform_real_distribution<double> number(0, 0.5);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3<double> d = (randomUnit(random) + Vec3<double>(0, 0, 1.2)).normalized();
    const TrianglePlace place{static_cast<size_t>(trial % 2), number(random), number(random)};
    const Vec3<double> found = radianceAt(maps, place, assume<Direction>(d), 1);
    const DiscPoint point = discPoint(maps.frames[0], assume<Direction>(d));
    for (int axis = 0; axis < 2; ++axis) {
      const double cell = std::clamp(point[axis] * size - 0.5, 0.0, size - 1.0);
      EXPECT_NEAR(found[axis], std::pow(2 * (120 / 127.0) * (7 * cell / 127), 2),
                  1e-6); // hat functions sum to 1
    }
    EXPECT_EQ(found[2], 0);
  }
}

TEST(LightFieldMaps, BelowTheHorizonTheBorderIsSeen) {
  const LightFieldMaps maps = syntheticMaps(squarePatch(1));
  const VertexFrame& frame = maps.frames[0];
  std::mt19937 random(5);
  for (int trial = 0; trial < 100; ++trial) {
    Vec3<double> d = randomUnit(random);
    d.z() = -std::abs(d.z());
    d.normalize();
    const Vec3<double> onHorizon = Vec3<double>(d.x(), d.y(), 0).normalized();
    const auto valueOf = [&](const Vec3<double>& v) {
      return viewValue(maps, 0, 0, discPoint(frame, assume<Direction>(v)));
    };
    EXPECT_LT((valueOf(d) - valueOf(onHorizon)).norm(), 1e-12);
  }
  EXPECT_TRUE(viewValue(maps, 0, 0, discPoint(frame, {0, 0, -1})).allFinite());
}

} // namespace
} // namespace surflect::lfm
