#include "warp/lattice.h"

#include "tests/support/each_simd.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace surflect::warp {
namespace {

// Calls function(point, its rest position) for every control point.
template <class Function> void forEachPoint(const Lattice& lattice, Function function) {
  const auto [l, m, n] = lattice.divisions;
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= m; ++j)
      for (int i = 0; i <= l; ++i) {
        const Vec3<double> place(double(i) / l, double(j) / m, double(k) / n);
        function(std::array{i, j, k}, lattice.least + place.cwiseProduct(lattice.most - lattice.least));
      }
}

double binomial(int n, int k) { return k == 0 ? 1 : binomial(n - 1, k - 1) * n / k; }

TEST(Lattice, AtRestIsTheIdentityEverywhere) {
  std::mt19937 random(1);
  Lattice lattice = randomLattice(random);
  std::ranges::fill(lattice.moves, Vec3<double>::Zero());
  const WarpPointer warp = latticeWarp(lattice);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> x = 3 * randomVector(random);
    EXPECT_EQ(warp->position(x), x);
    EXPECT_EQ(*warp->jacobian(x), Mat3<double>::Identity());
  }
}

// [Sederberg and Parry 1986, Eq. 2], literally.
TEST(Lattice, InsideTheBoxItIsTheSumOverBernsteinPolynomials) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Lattice lattice = randomLattice(random);
    const Vec3<double> place = (randomVector(random) + Vec3<double>::Ones()) / 2;
    Vec3<double> expected = Vec3<double>::Zero();
    forEachPoint(lattice, [&](const std::array<int, 3>& point, const Vec3<double>& rest) {
      double weight = 1;
      for (int a = 0; a < 3; ++a) {
        const int n = lattice.divisions[a], i = point[a];
        weight *= binomial(n, i) * std::pow(1 - place[a], n - i) * std::pow(place[a], i);
      }
      expected += weight * (rest + lattice.moves[lattice.pointIndex(point)]);
    });
    const Vec3<double> x = lattice.least + place.cwiseProduct(lattice.most - lattice.least);
    EXPECT_LT((latticeWarp(lattice)->position(x) - expected).norm(), 3e-15);
  }
}

TEST(Lattice, AffineMovesOfItsPointsMoveAllSpaceAffinely) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    Lattice lattice = randomLattice(random);
    Mat3<double> linear;
    for (int i = 0; i < 3; ++i) linear.col(i) = randomVector(random);
    const Vec3<double> offset = randomVector(random);
    forEachPoint(lattice, [&](const std::array<int, 3>& point, const Vec3<double>& rest) {
      lattice.moves[lattice.pointIndex(point)] = linear * rest + offset - rest;
    });
    const WarpPointer warp = latticeWarp(lattice);
    const Vec3<double> x = 2 * randomVector(random);
    EXPECT_LT((warp->position(x) - linear * x - offset).norm(), 4e-14);
    EXPECT_LT((*warp->jacobian(x) - linear).norm(), 4e-14);
  }
}

TEST(Lattice, PositionAndJacobianAreContinuousAcrossTheBox) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 300; ++trial) {
    const Lattice lattice = randomLattice(random);
    const WarpPointer warp = latticeWarp(lattice);
    // On one, two or all three of the faces that meet at a corner.
    Vec3<double> x = randomVector(random);
    for (int a = 0; a < 3; ++a)
      if (a == trial % 3 || random() & 1) x[a] = random() & 1 ? lattice.least[a] : lattice.most[a];
    const double epsilon = 1e-7;
    const Vec3<double> step = epsilon * randomUnit(random);
    EXPECT_LT((warp->position(x + step) - warp->position(x - step)).norm(), 10 * epsilon);
    EXPECT_LT((*warp->jacobian(x + step) - *warp->jacobian(x - step)).norm(), 100 * epsilon);
  }
}

// On one side of a face at least: there the warp is a polynomial, but for the clamping of other axes.
TEST(Lattice, BeyondTheBoxTheJacobianIsThatOfThePosition) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 100; ++trial) {
    const WarpPointer warp = randomLatticeWarp(random);
    Vec3<double> x = 3 * randomVector(random);
    x[trial % 3] = random() & 1 ? 2 : -2;
    EXPECT_LT((centralDifferences(*warp, x, Mat3<double>::Identity(), 1e-6) - *warp->jacobian(x)).norm(),
              3e-9);
  }
}

// With every kind of vector instructions, at the same places in and around a box of this half side. Places
// may differ by `error` half sides, tangents by twice as much.
void expectBatchesMoveAsPoints(const Warp& warp, double half, double error, std::mt19937& random) {
  std::vector<Vec3<double>> places;
  for (int i = 0; i < 100; ++i) places.push_back(1.5 * half * randomVector(random));
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    WarpBatch b;
    b.count = 100;
    for (int i = 0; i < b.count; ++i) {
      b.x[i] = places[i].x(), b.y[i] = places[i].y(), b.z[i] = places[i].z();
      b.ux[i] = b.vy[i] = b.determinant[i] = 1;
      b.uy[i] = b.uz[i] = b.vx[i] = b.vz[i] = 0;
    }
    warp.carry(b);
    for (int i = 0; i < b.count; ++i) {
      const Mat3<double> j = *warp.jacobian(places[i]);
      EXPECT_LT((warp.position(places[i]) - Vec3<double>(b.x[i], b.y[i], b.z[i])).norm(), error * half);
      EXPECT_LT((j.col(0) - Vec3<double>(b.ux[i], b.uy[i], b.uz[i])).norm(), 2 * error);
      EXPECT_LT((j.col(1) - Vec3<double>(b.vx[i], b.vy[i], b.vz[i])).norm(), 2 * error);
      EXPECT_NEAR(b.determinant[i], j.determinant(), error * j.squaredNorm() * j.norm());
    }
  }
}

// Up to 24 divisions go by powers in batches, more by Bernstein polynomials as ever.
TEST(Lattice, OfManyDivisionsMovesBatchesAsItMovesPoints) {
  std::mt19937 random(7);
  for (const std::array<int, 3>& divisions : {std::array{8, 8, 8},
                                              {16, 4, 4},
                                              {1, 7, 16},
                                              {9, 8, 8},
                                              {16, 16, 2},
                                              {3, 3, 3},
                                              {3, 3, 2},
                                              {1, 1, 1}}) {
    Lattice lattice = randomLattice(random);
    lattice.divisions = divisions;
    lattice.moves.clear();
    for (size_t i = 0; i < lattice.pointCount(); ++i) lattice.moves.push_back(0.1 * randomVector(random));
    expectBatchesMoveAsPoints(*latticeWarp(lattice), 1, 4.5e-14, random);
  }
}

// Also where a power of the box's sides is beyond what doubles hold.
TEST(Lattice, OfAnySizeMovesBatchesAsItMovesPoints) {
  std::mt19937 random(8);
  for (const int divisions : {3, 8})
    for (const int exponent : {-300, -100, -31, 31, 100, 300}) {
      const double size = std::ldexp(1, exponent);
      Lattice lattice = randomLattice(random);
      lattice.least *= size;
      lattice.most *= size;
      lattice.divisions = {divisions, divisions, divisions};
      lattice.moves.clear();
      for (size_t i = 0; i < lattice.pointCount(); ++i)
        lattice.moves.push_back(0.1 * size * randomVector(random));
      expectBatchesMoveAsPoints(*latticeWarp(lattice), size, divisions == 3 ? 6e-16 : 1.4e-14, random);
    }
}

TEST(Lattice, WhereTheTwoOutermostLayersRestSoDoesAllBeyond) {
  std::mt19937 random(5);
  Lattice lattice = randomLattice(random);
  lattice.divisions = {2, 2, 4};
  lattice.moves.assign(lattice.pointCount(), Vec3<double>::Zero());
  forEachPoint(lattice, [&](const std::array<int, 3>& point, const Vec3<double>&) {
    if (point[2] >= 2) lattice.moves[lattice.pointIndex(point)] = randomVector(random);
  });
  const WarpPointer warp = latticeWarp(lattice);
  for (int i = 0; i < 100; ++i) {
    Vec3<double> x = 2 * randomVector(random);
    x[2] = lattice.least[2] - std::abs(x[2]);
    EXPECT_EQ(warp->position(x), x);
    EXPECT_EQ(*warp->jacobian(x), Mat3<double>::Identity());
  }
}

} // namespace
} // namespace surflect::warp
