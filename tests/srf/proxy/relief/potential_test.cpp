#include "srf/proxy/relief/potential.h"

#include <Eigen/Sparse>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::relief {
namespace {

size_t at(const image::Mask& mask, int x, int y) {
  return static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x);
}

// Blobs with holes, thin necks and pieces that touch at corners only.
image::Mask randomMask(int width, int height, double share, uint32_t seed) {
  std::mt19937 random(seed);
  image::Mask mask(width, height);
  for (auto& inside : mask.inside) inside = std::uniform_real_distribution()(random) < share;
  return mask;
}

// Pieces by number, from 1 on; 0 off the mask.
std::vector<int> pieces(const Differences& d) {
  std::vector<int> piece(d.mask.inside.size(), 0);
  int count = 0;
  for (size_t seed = 0; seed < piece.size(); ++seed) {
    if (!d.mask.inside[seed] || piece[seed]) continue;
    piece[seed] = ++count;
    for (bool grows = true; grows;) {
      grows = false;
      const auto join = [&](size_t i, size_t j) {
        if ((piece[i] == count) == (piece[j] == count)) return;
        piece[i] = piece[j] = count;
        grows = true;
      };
      for (size_t i = 0; i < piece.size(); ++i) {
        if (d.rightWeight[i] > 0) join(i, i + 1);
        if (d.downWeight[i] > 0) join(i, i + static_cast<size_t>(d.mask.width));
      }
    }
  }
  return piece;
}

void takeMeans(const Differences& d, std::vector<double>& f) {
  const auto piece = pieces(d);
  std::vector<double> sums(f.size() + 1, 0), counts(f.size() + 1, 0);
  for (size_t i = 0; i < f.size(); ++i) {
    sums[static_cast<size_t>(piece[i])] += f[i];
    ++counts[static_cast<size_t>(piece[i])];
  }
  for (size_t i = 0; i < f.size(); ++i)
    f[i] = piece[i] ? f[i] - sums[static_cast<size_t>(piece[i])] / counts[static_cast<size_t>(piece[i])] : 0;
}

// The normal equations by a direct solver; a pull to 0 on the first pixel of every piece makes them definite.
std::vector<double> directPotential(const Differences& d) {
  const auto n = static_cast<Eigen::Index>(d.mask.inside.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  const auto add = [&](size_t from, size_t to, double weight, double difference) {
    const auto i = static_cast<int>(from), j = static_cast<int>(to);
    entries.emplace_back(i, i, weight);
    entries.emplace_back(j, j, weight);
    entries.emplace_back(i, j, -weight);
    entries.emplace_back(j, i, -weight);
    b[i] -= weight * difference;
    b[j] += weight * difference;
  };
  const auto piece = pieces(d);
  for (size_t i = 0; i < d.mask.inside.size(); ++i) {
    const bool isFirst =
        std::find(piece.begin(), piece.end(), piece[i]) - piece.begin() == static_cast<int>(i);
    if (isFirst || piece[i] == 0) entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1);
    if (d.rightWeight[i] > 0) add(i, i + 1, d.rightWeight[i], d.right[i]);
    if (d.downWeight[i] > 0) add(i, i + static_cast<size_t>(d.mask.width), d.downWeight[i], d.down[i]);
  }
  Eigen::SparseMatrix<double> a(n, n);
  a.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd f = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(a).solve(b);
  std::vector<double> values(f.begin(), f.end());
  takeMeans(d, values);
  return values;
}

TEST(Potential, IsThatOfADirectSolver) {
  for (const double share : {1.0, 0.9, 0.7, 0.5, 0.2}) {
    std::mt19937 random(7);
    Differences d(randomMask(37, 50, share, 11));
    for (size_t i = 0; i < d.right.size(); ++i) {
      d.right[i] = std::normal_distribution<double>()(random);
      d.down[i] = std::normal_distribution<double>()(random);
      d.rightWeight[i] *= std::uniform_real_distribution(0.01, 1.0)(random);
      d.downWeight[i] *= std::uniform_real_distribution(0.01, 1.0)(random);
    }
    const auto f = potentialOf(d, {}), direct = directPotential(d);
    for (size_t i = 0; i < f.size(); ++i) EXPECT_NEAR(f[i], direct[i], 3e-6);
  }
}

TEST(Potential, DifferencesOfAFunctionGiveItBack) {
  for (const double share : {1.0, 0.8, 0.6}) {
    std::mt19937 random(3);
    Differences d(randomMask(83, 61, share, 5));
    std::vector<double> truth(d.mask.inside.size(), 0);
    for (double& value : truth) value = std::normal_distribution<double>()(random);
    for (size_t i = 0; i < truth.size(); ++i) {
      if (d.rightWeight[i] > 0) d.right[i] = truth[i + 1] - truth[i];
      if (d.downWeight[i] > 0) d.down[i] = truth[i + 83] - truth[i];
    }
    takeMeans(d, truth);
    const auto f = potentialOf(d, {});
    for (size_t i = 0; i < f.size(); ++i) EXPECT_NEAR(f[i], truth[i], 1e-6);
  }
}

TEST(Potential, PiecesDoNotKnowOfEachOther) {
  Differences d(randomMask(40, 30, 1, 1));
  for (double& value : d.right) value = 1;
  for (int y = 0; y < 30; ++y) d.rightWeight[at(d.mask, 19, y)] = 0; // cut, without a gap
  const auto f = potentialOf(d, {});
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) EXPECT_NEAR(f[at(d.mask, x, y)], x % 20 - 9.5, 1e-6);
}

TEST(Potential, NoPixelsNoAnswer) {
  EXPECT_TRUE(potentialOf(Differences(image::Mask(0, 0)), {}).empty());
  const auto nothing = potentialOf(Differences(image::Mask(5, 4)), {});
  EXPECT_EQ(nothing, std::vector<double>(20, 0));
}

TEST(Potential, Cancels) {
  Differences d(randomMask(16, 16, 1, 1));
  d.right[3] = 1;
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(potentialOf(d, progress), Cancelled);
}

} // namespace
} // namespace surflect::relief
