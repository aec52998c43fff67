// Symbols: X radiance, rows (present texel, channel), columns lights; V and W the weights of channels and
//          lights; sigma_k^2 the energy of term k; K the rank.
#include "srf/codec/block_encoder.h"

#include "srf/codec/block_bound.h"
#include "srf/codec/block_fit.h"
#include "srf/codec/block_kernels.h"
#include "srf/codec/block_levels.h"
#include "srf/codec/transpose.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

namespace surflect::codec {

namespace {

using Eigen::MatrixXf;

// Of what a block holds: above this bound single precision is enough. The scalar products of its columns then
// have errors of some 1e-7 of what it holds, and a term that matters has a hundredth of the bound.
constexpr double kSinglePrecision = 2e-5;
// Of the bound: what the terms that are not looked at may hold together, at first.
constexpr double kLookedAt = 0.5;
// Fitted levels lower the squared error of rounded ones by up to about a tenth.
constexpr double kLowered = 1.1;

// X, and what its errors are measured by.
struct MeasuredBlock {
  PaddedRows<float> x;
  double white = 1;
  BlockWeights weights;
  double squared = 0, squaredBound = 0; // of V X W, and of its error
  ChannelSums channels;
};

// A step of one term from a precision (at first: none) to a higher one.
struct Upgrade {
  size_t term = 0;
  int bits = 0;
  double saved = 0; // squared error
  double savedPerByte = 0;
};

// All steps worth taking, best first; every beginning of the list is the cheapest choice of rank and
// precisions for the error that it leaves (a Lagrangian optimum: per term the steps follow the convex hull).
template <class Real>
std::vector<Upgrade> upgradesOf(const BlockFactors<Real>& factors, const BlockFit<Real>& fit,
                                CoefficientType type) {
  struct Choice {
    int bits;
    double bytes, squaredError;
  };
  std::vector<Upgrade> upgrades;
  upgrades.reserve(precisions.size() * factors.energies.size());
  for (size_t k = 0; k < factors.energies.size(); ++k) {
    const double energy = factors.energies[k];
    std::array<Choice, 4> choices = {{{0, 0, energy}}};
    for (size_t i = 1; const int bits : {4, 8, 16}) {
      const size_t bytes =
          levelBytes(factors.images.rows(), bits) + coefficientBytes(factors.lights.rows(), bits, type);
      const double left = energy * (fit.imageError(k, bits) + fit.lightError(k, bits));
      choices[i++] = {bits, static_cast<double>(bytes), left};
    }
    for (size_t from = 0;;) {
      Upgrade steepest;
      size_t to = from;
      for (size_t i = from + 1; i < choices.size(); ++i) {
        const double saved = choices[from].squaredError - choices[i].squaredError;
        const double savedPerByte = saved / (choices[i].bytes - choices[from].bytes);
        if (savedPerByte <= steepest.savedPerByte) continue;
        steepest = {k, choices[i].bits, saved, savedPerByte};
        to = i;
      }
      if (to == from) break;
      upgrades.push_back(steepest);
      from = to;
    }
  }
  std::ranges::stable_sort(upgrades, std::greater{}, &Upgrade::savedPerByte);
  return upgrades;
}

std::vector<ChosenTerm> chosen(std::span<const Upgrade> upgrades) {
  std::vector<ChosenTerm> terms;
  terms.reserve(upgrades.size());
  for (const Upgrade& upgrade : upgrades) {
    const auto same = std::ranges::find(terms, upgrade.term, &ChosenTerm::term);
    if (same == terms.end())
      terms.push_back({upgrade.term, upgrade.bits});
    else
      same->bits = upgrade.bits;
  }
  std::ranges::sort(terms, [](const ChosenTerm& a, const ChosenTerm& b) {
    return a.bits != b.bits ? a.bits > b.bits : a.term < b.term;
  });
  return terms;
}

// Errors of stored numbers, in double precision.
struct StoredErrors {
  double squared = 0, clipped = 0, weighted = 0;
};

// Of X as it is; X where there are no terms. `clipped`: null, or the error of clipped numbers.
BlockSquares squaresOf(const PaddedRows<float>& x, const StoredTerms& stored, double white = 0,
                       double* clipped = nullptr) {
  const size_t rank = stored.terms.size(), lights = x.columns();
  std::vector<double> levels(x.rows() * rank);
  const PaddedRows<double> perLevel = shownPerLevel(stored, lights);
  for (size_t k = 0; k < rank; ++k)
    for (size_t i = 0; i < x.rows(); ++i)
      levels[(i / 3 * rank + k) * 3 + i % 3] = double{stored.terms[k].levels[i]};
  PaddedRows<double> sums(3, lights), clippedSums(1, lights);
  blockErrors({x.row(0), x.rows() / 3, x.stride(), levels.data(), perLevel.row(0), rank, white, sums.row(0),
               clipped ? clippedSums.row(0) : nullptr});
  const auto columns = static_cast<Eigen::Index>(lights);
  BlockSquares squares{Eigen::Matrix3Xd(3, columns), static_cast<Eigen::Index>(x.rows() / 3)};
  for (int c = 0; c < 3; ++c)
    squares.sums.row(c) = Eigen::Map<const Eigen::RowVectorXd>(sums.row(static_cast<size_t>(c)), columns);
  if (clipped) *clipped = std::accumulate(clippedSums.row(0), clippedSums.row(0) + lights, 0.);
  return squares;
}

StoredErrors errorsOf(const MeasuredBlock& block, const StoredTerms& stored) {
  StoredErrors errors;
  const BlockSquares squares = squaresOf(block.x, stored, block.white, &errors.clipped);
  errors.squared = squares.sums.sum();
  errors.weighted = weightedSquares(squares, block.weights);
  return errors;
}

struct Encoding {
  StoredTerms stored;
  StoredErrors errors;
};

// Whether a term weaker than all of these, at 4 bits, might save as much per byte as the last of the
// upgrades: then it should have been among them.
template <class Real>
bool wantsMore(const BlockFactors<Real>& factors, std::span<const Upgrade> upgrades, CoefficientType type) {
  const size_t most = std::min(factors.images.rows(), factors.lights.rows());
  if (upgrades.empty() || factors.energies.size() == most) return false;
  const size_t bytes =
      levelBytes(factors.images.rows(), 4) + coefficientBytes(factors.lights.rows(), 4, type);
  return factors.energies.back() > upgrades.back().savedPerByte * static_cast<double>(bytes);
}

// Empty where no choice of these terms, with coefficients of this type, keeps the bound, or where `wary` and
// more terms might be better.
template <class Real>
std::optional<Encoding> cheapest(const MeasuredBlock& block, const WeightedBlock<Real>& weighted,
                                 const BlockFactors<Real>& factors, CoefficientType type, bool wary) {
  BlockFit<Real> fit(weighted, factors);
  const std::vector<Upgrade> all = upgradesOf(factors, fit, type);
  const auto first = [&](size_t count) { return std::span(all).first(count); };
  const auto solved = [&](size_t count) { return fit.solved(chosen(first(count)), type); };
  const double bound = weighted.squaredBound;
  const auto mayKeepBound = [&](const auto& solution) { // NaN does not
    return solution.squaredError <= kLowered * bound;
  };
  // Encoding by the first upgrades with these coefficients; empty if it breaks the bounds once levels are
  // fitted.
  const auto attempt = [&](size_t upgrades, auto solution) -> std::optional<Encoding> {
    fit.addLevels(chosen(first(upgrades)), solution.stored);
    if (!fitLevels(weighted, block.channels, solution.stored)) return std::nullopt;
    const StoredErrors errors = errorsOf(block, solution.stored);
    if (!(errors.weighted <= block.squaredBound)) return std::nullopt;
    return Encoding{std::move(solution.stored), errors};
  };

  size_t count = 0;
  for (double left = factors.energy; left > bound && count < all.size(); ++count) left -= all[count].saved;

  // From the predicted choice up until the actual error may be small enough, then down while it still may.
  auto solution = solved(count);
  for (size_t step = 1; !mayKeepBound(solution); step *= 2) {
    if (count == all.size()) return std::nullopt;
    count = std::min(count + step, all.size());
    solution = solved(count);
  }
  for (; count > 0; --count) {
    auto cheaper = solved(count - 1);
    if (!mayKeepBound(cheaper)) break;
    solution = std::move(cheaper);
  }
  if (wary && wantsMore(factors, first(count), type)) return std::nullopt;
  // Up again where it is not.
  std::optional<Encoding> encoding = attempt(count, std::move(solution));
  while (!encoding && count < all.size()) {
    ++count;
    encoding = attempt(count, solved(count));
  }
  return encoding;
}

template <class Real> WeightedBlock<Real> weightedOf(const MeasuredBlock& block) {
  const PaddedRows<float>& x = block.x;
  WeightedBlock<Real> weighted{PaddedRows<Real>(x.rows(), x.columns()), {}, {}, 0};
  const double scale = 1 / std::sqrt(block.squared);
  for (const double weight : block.weights.lights)
    weighted.lights.push_back(static_cast<Real>(weight * scale));
  for (size_t i = 0; i < x.rows(); ++i)
    weighted.rows.push_back(static_cast<Real>(block.weights.channels[static_cast<Eigen::Index>(i % 3)]));
  for (size_t i = 0; i < x.rows(); ++i) {
    const float* const from = x.row(i);
    const Real* const lights = weighted.lights.data();
    Real* const to = weighted.values.row(i);
    for (size_t l = 0; l < x.columns(); ++l)
      to[l] = static_cast<Real>(from[l]) * lights[l] * weighted.rows[i];
  }
  weighted.squaredBound = block.squaredBound / block.squared;
  return weighted;
}

template <class Real>
std::optional<Encoding> encodedAs(const MeasuredBlock& block, CoefficientType type, double lookedAt) {
  const WeightedBlock<Real> weighted = weightedOf<Real>(block);
  // At least half of the block is looked at, also where the error bound alone would allow none of it: the
  // means must still come back.
  const BlockFactors<Real> factors =
      factorised(weighted, static_cast<Real>(lookedAt * std::min(1., weighted.squaredBound)));
  return cheapest(block, weighted, factors, type, lookedAt > 0);
}

// Whether the bound lets single precision do, and the weights leave room for squares and ratios in it.
bool fitsSingle(const MeasuredBlock& block) {
  constexpr double kMost = 1e15;
  const double scale = 1 / std::sqrt(block.squared);
  return block.squaredBound > kSinglePrecision * block.squared && block.weights.channels.maxCoeff() < kMost &&
         block.weights.lights.maxCoeff() * scale < kMost &&
         block.weights.lights.minCoeff() * scale * kMost > 1;
}

// Empty where the bounds are out of reach.
std::optional<Encoding> encodedWithinBounds(const MeasuredBlock& block) {
  const auto& [sums, bounds] = block.channels;
  const bool black =
      std::ranges::equal(sums, bounds, [](double sum, double most) { return std::abs(sum) <= most; });
  if (black && block.squared <= block.squaredBound) return Encoding{{}, errorsOf(block, {})};
  const bool single = fitsSingle(block);
  for (const CoefficientType type : {CoefficientType::half, CoefficientType::single}) {
    if (single)
      for (const double lookedAt : {kLookedAt, 0.})
        if (auto encoding = encodedAs<float>(block, type, lookedAt)) return encoding;
    if (auto encoding = encodedAs<double>(block, type, 0)) return encoding;
  }
  return std::nullopt;
}

// A channel that is almost black beside another may be out of reach of 16 bits: then its mean errs like an
// eighth of that other's may, by 2.5e-4 of it, or as it comes.
Encoding encoded(MeasuredBlock block) {
  const double brightest = std::ranges::max(block.channels.bounds);
  for (const double part : {0., 0.125, std::numeric_limits<double>::infinity()}) {
    for (double& bound : block.channels.bounds) bound = std::max(bound, part * brightest);
    if (auto encoding = encodedWithinBounds(block)) return *std::move(encoding);
  }
  throw Error("a block spans too many orders of magnitude to be stored within the tolerance");
}

PaddedRows<float> byRows(const MatrixXf& m) {
  PaddedRows<float> x(static_cast<size_t>(m.rows()), static_cast<size_t>(m.cols()));
  transpose(m.data(), x.rows(), x.columns(), x.rows(), x.row(0), x.stride());
  return x;
}

} // namespace

EncodedBlock encodeBlock(uint64_t present, const MatrixXf& radiance, double tolerance, double white) {
  assert(present != 0 && radiance.rows() == 3 * std::popcount(present) && radiance.cols() > 0 && white > 0);
  MeasuredBlock block{byRows(radiance), white, {}, 0, 0, {}};
  const BlockSquares squares = squaresOf(block.x, {});
  block.weights = blockWeights(squares, white);
  block.squared = weightedSquares(squares, block.weights);
  const double bound = blockErrorBound(squares, block.weights, tolerance, white);
  block.squaredBound = bound * bound;
  block.channels = channelSums(block.x, white);

  const auto lights = block.x.columns();
  const Encoding encoding = encoded(std::move(block));
  return {recordOf(present, lights, encoding.stored), static_cast<int>(encoding.stored.terms.size()),
          encoding.errors.squared, encoding.errors.clipped};
}

} // namespace surflect::codec
