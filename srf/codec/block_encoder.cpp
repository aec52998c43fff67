// Encodes a block in four steps: factor V X W ~ sum_k sigma_k e_k a_k', choose rank and precisions, solve the
// coefficients again for the rounded eigenimages, and fit levels until the error bounds hold.
//
// Symbols: X radiance, rows (present texel, channel), columns lights; V and W the weights of channels and
//          lights; sigma_k^2 the energy of term k; K the rank.
#include "srf/codec/block_encoder.h"

#include "srf/codec/block.h"
#include "srf/codec/block_fit.h"
#include "srf/codec/block_kernels.h"
#include "surfel/base/error.h"
#include "surfel/math/padded_rows.h"

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

// Squared bound, as a fraction of the block's energy, above which single precision is enough: scalar products
// of columns then err by about 1e-7 of the energy, while any term that matters has at least a hundredth of
// the squared bound.
constexpr double kSinglePrecision = 2e-5;
// Fraction of the squared bound that terms left out of the first factorisation may have.
constexpr double kLookedAt = 0.5;
// Fitting levels lowers the squared error of rounding by up to about a tenth.
constexpr double kLowered = 1.1;

// X with the weights and bounds of its errors.
struct MeasuredBlock {
  PaddedRows<float> x;
  double white = 1;
  BlockWeights weights;
  double squared = 0, squaredBound = 0; // |V X W|_F^2 and the bound on its error
  ChannelSums channels;
};

// Raises one term from a precision (or from being absent) to a higher precision.
struct Upgrade {
  size_t term = 0;
  int bits = 0;
  double saved = 0; // squared error
  double savedPerByte = 0;
};

// All upgrades worth making, best first. Every prefix is the cheapest choice of rank and precisions for the
// error that it leaves: a Lagrangian optimum, as the upgrades of a term follow the convex hull of error over
// bytes.
template <class Real>
std::vector<Upgrade> upgradesOf(const TruncatedSvd<Real>& factors, const BlockFit<Real>& fit,
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
          levelBytes(factors.left.rows(), bits) + coefficientBytes(factors.right.rows(), bits, type);
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

// Squared errors of the stored numbers, in double precision: unweighted, clipped to [0, white], and weighted.
struct StoredErrors {
  double squared = 0, clipped = 0, weighted = 0;
};

// Sums of (X - X')^2; of X^2 if there are no terms. `clipped`, if not null, receives the squared error after
// both are clipped to [0, white].
ChannelEnergies squaresOf(const PaddedRows<float>& x, const StoredTerms& stored, double white = 0,
                          double* clipped = nullptr) {
  const size_t rank = stored.terms.size(), lights = x.columns();
  std::vector<double> levels(x.rows() * rank);
  const PaddedRows<double> perLevel = radiancePerLevel(stored, lights);
  for (size_t k = 0; k < rank; ++k)
    for (size_t i = 0; i < x.rows(); ++i)
      levels[(i / 3 * rank + k) * 3 + i % 3] = double{stored.terms[k].levels[i]};
  PaddedRows<double> sums(3, lights), clippedSums(1, lights);
  blockErrors({x.row(0), x.rows() / 3, x.stride(), levels.data(), perLevel.row(0), rank, white, sums.row(0),
               clipped ? clippedSums.row(0) : nullptr});
  const auto columns = static_cast<Eigen::Index>(lights);
  ChannelEnergies squares{Eigen::Matrix3Xd(3, columns), static_cast<Eigen::Index>(x.rows() / 3)};
  for (int c = 0; c < 3; ++c)
    squares.sums.row(c) = Eigen::Map<const Eigen::RowVectorXd>(sums.row(static_cast<size_t>(c)), columns);
  if (clipped) *clipped = std::accumulate(clippedSums.row(0), clippedSums.row(0) + lights, 0.);
  return squares;
}

StoredErrors errorsOf(const MeasuredBlock& block, const StoredTerms& stored) {
  StoredErrors errors;
  const ChannelEnergies squares = squaresOf(block.x, stored, block.white, &errors.clipped);
  errors.squared = squares.sums.sum();
  errors.weighted = weightedSquares(squares, block.weights);
  return errors;
}

struct Encoding {
  StoredTerms stored;
  StoredErrors errors;
};

// Returns true if one more term of 4 bits, weaker than all factored ones, might lower the error by as much
// per byte as the last of the upgrades. The block then needs more factors.
template <class Real>
bool wantsMore(const TruncatedSvd<Real>& factors, std::span<const Upgrade> upgrades, CoefficientType type) {
  const size_t most = std::min(factors.left.rows(), factors.right.rows());
  if (upgrades.empty() || factors.energies.size() == most) return false;
  const size_t bytes = levelBytes(factors.left.rows(), 4) + coefficientBytes(factors.right.rows(), 4, type);
  return factors.energies.back() > upgrades.back().savedPerByte * static_cast<double>(bytes);
}

// The cheapest encoding of these terms that keeps the bound. Empty if none does with coefficients of this
// type, or if `wary` is set and more terms might make the encoding cheaper.
template <class Real>
std::optional<Encoding> cheapest(const MeasuredBlock& block, const WeightedBlock<Real>& weighted,
                                 const TruncatedSvd<Real>& factors, CoefficientType type, bool wary) {
  BlockFit<Real> fit(weighted, factors);
  const std::vector<Upgrade> all = upgradesOf(factors, fit, type);
  const auto first = [&](size_t count) { return std::span(all).first(count); };
  const auto solved = [&](size_t count) { return fit.solved(chosen(first(count)), type); };
  const double bound = weighted.squaredBound;
  const auto mayKeepBound = [&](const auto& solution) { // false for NaN
    return solution.squaredError <= kLowered * bound;
  };
  // Encodes the first upgrades with the coefficients of `solution`. Empty if a bound is exceeded after levels
  // are fitted.
  const auto attempt = [&](size_t upgrades, auto solution) -> std::optional<Encoding> {
    fit.addLevels(chosen(first(upgrades)), solution.stored);
    if (!fitLevels(weighted, block.channels, solution.stored)) return std::nullopt;
    const StoredErrors errors = errorsOf(block, solution.stored);
    if (!(errors.weighted <= block.squaredBound)) return std::nullopt;
    return Encoding{std::move(solution.stored), errors};
  };

  size_t count = 0;
  for (double left = factors.energy; left > bound && count < all.size(); ++count) left -= all[count].saved;

  // Starts from the predicted number of upgrades; takes more until the error may be small enough, then fewer
  // while it may still be.
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
  // Takes more upgrades again if the actual error is too large.
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
  // Factors leave out at most half of the block's energy: even where the error bound would allow more, the
  // means of the channels must be preserved.
  const TruncatedSvd<Real> factors =
      truncatedSvd(weighted.values, static_cast<Real>(lookedAt * std::min(1., weighted.squaredBound)));
  return cheapest(block, weighted, factors, type, lookedAt > 0);
}

// Returns true if the bound allows single precision, and squares and ratios of the weights stay in its range.
bool fitsSingle(const MeasuredBlock& block) {
  constexpr double kMost = 1e15;
  const double scale = 1 / std::sqrt(block.squared);
  return block.squaredBound > kSinglePrecision * block.squared && block.weights.channels.maxCoeff() < kMost &&
         block.weights.lights.maxCoeff() * scale < kMost &&
         block.weights.lights.minCoeff() * scale * kMost > 1;
}

// Encodes within both bounds; empty if that is impossible.
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

// Encodes a block, relaxing the bounds of channel means that 16 bits cannot reach, as of an almost black
// channel beside a bright one. Such a mean may err by an eighth of the brightest channel's bound (2.5e-4 of
// that channel's mean), or by any amount if even that cannot be reached.
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
  const ChannelEnergies squares = squaresOf(block.x, {});
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
