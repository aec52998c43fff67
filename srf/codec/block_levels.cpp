// Fits the levels of eigenimages by coordinate descent on |V (X - X') W|^2, then moves single levels until
// the sum of each channel keeps its bound.
//
// Symbols: Q the levels of images, rows (texel, channel), columns terms; P the radiance of one level, rows
//          terms, columns lights, so that X' = Q P; W the weights of lights; C = P W^2 P';
//          R = (X - X') W^2 P'. The error is least if level q_ik moves by r_ik / c_kk.
#include "srf/codec/block_levels.h"

#include "srf/codec/block_bound.h"
#include "srf/codec/block_kernels.h"
#include "surfel/math/padded_products.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace surflect::codec {

namespace {

constexpr int kSteps = 8; // rounds of moves of one term

// Threshold of an 8 x 8 ordered dither, in [0, 1) [Bayer 1973]: texels with consecutive thresholds are far
// apart.
double ditherThreshold(size_t texel) {
  double threshold = 0;
  for (size_t bit = 0, parts = 4; bit < 3; ++bit, parts *= 4) {
    const size_t x = texel >> bit & 1, y = texel >> (bit + 3) & 1;
    threshold += static_cast<double>(2 * (x ^ y) + y) / static_cast<double>(parts);
  }
  return threshold;
}

template <class Real> class LevelFit {
public:
  LevelFit(const WeightedBlock<Real>& block, const StoredTerms& stored)
      : rows_(block.values.rows()), rank_(stored.terms.size()), q_(rows_, rank_), c_(0, 0), r_(0, 0),
        last_(rank_), sums_(rank_) {
    const size_t lights = block.values.columns();
    const PaddedRows<double> shown = radiancePerLevel(stored, lights);
    PaddedRows<Real> pw(rank_, lights), wp(lights, rank_);
    for (size_t k = 0; k < rank_; ++k) {
      const StoredTerm& term = stored.terms[k];
      last_[k] = static_cast<Real>(levelsOf(term.bits));
      sums_[k] = std::accumulate(shown.row(k), shown.row(k) + lights, 0.);
      for (size_t l = 0; l < lights; ++l)
        pw.row(k)[l] = wp.row(l)[k] = static_cast<Real>(shown.row(k)[l]) * block.lights[l];
      for (size_t i = 0; i < rows_; ++i) q_.row(i)[k] = static_cast<Real>(term.levels[i]);
    }
    c_ = product(pw, wp);
    r_ = product(block.values, wp);
    inverse_.resize(c_.stride());
    const PaddedRows<Real> ofLevels = product(q_, c_);
    for (size_t i = 0; i < rows_; ++i) {
      const Real unweighted = 1 / block.rows[i];
      Real* const r = r_.row(i);
      const Real* const of = ofLevels.row(i);
      for (size_t k = 0; k < r_.stride(); ++k) r[k] = r[k] * unweighted - of[k];
    }
    for (size_t k = 0; k < rank_; ++k)
      if (const Real square = c_.row(k)[k]; square > std::numeric_limits<Real>::min())
        inverse_[k] = 1 / square;
  }

  // Moves each level in turn to the value of least error, given all other levels.
  void lowerError() {
    for (size_t i = 0; i < rows_; ++i) {
      const Real *const q = q_.row(i), *const r = r_.row(i);
      for (size_t k = 0; k < rank_; ++k) {
        const Real distance = r[k] * inverse_[k];
        if (std::abs(distance) <= Real{0.5}) continue;
        const Real to =
            std::clamp(q[k] + distance, -last_[k], last_[k]) + wholeShift<Real> - wholeShift<Real>;
        if (to != q[k]) move(i, k, to - q[k]);
      }
    }
  }

  // Moves levels of one channel until its sum is within the bound: first levels of the term whose sum over
  // lights is largest, which best resembles the missing radiance under each light, then levels of fainter
  // terms.
  bool keepSum(size_t channel, double sum, double bound) {
    std::vector<Real> totals(q_.stride()); // integers that a float holds exactly
    for (size_t i = channel; i < rows_; i += 3)
      for (size_t k = 0; k < totals.size(); ++k) totals[k] += q_.row(i)[k];
    double missing = sum;
    for (size_t k = 0; k < rank_; ++k) missing -= static_cast<double>(totals[k]) * sums_[k];
    for (int step = 0; step < kSteps && std::abs(missing) > bound; ++step) {
      double coarsest = 0;
      size_t term = 0;
      for (size_t k = 0; k < rank_; ++k) {
        const double size = std::abs(sums_[k]);
        if (size <= coarsest || size >= 2 * std::abs(missing)) continue;
        coarsest = size;
        term = k;
      }
      if (coarsest == 0) return false;
      missing -= moveSome(channel, term, std::round(missing / sums_[term])) * sums_[term];
    }
    return std::abs(missing) <= bound; // false for NaN
  }

  void store(StoredTerms& stored) const {
    for (size_t k = 0; k < rank_; ++k)
      for (size_t i = 0; i < rows_; ++i) stored.terms[k].levels[i] = static_cast<float>(q_.row(i)[k]);
  }

private:
  void move(size_t row, size_t term, Real by) {
    q_.row(row)[term] += by;
    Real* const r = r_.row(row);
    const Real* const c = c_.row(term);
    for (size_t k = 0; k < r_.stride(); ++k) r[k] -= by * c[k];
  }

  // Moves up to |count| levels of a channel by one, in the direction of count's sign, where the error grows
  // least. Returns the number of moves with that sign.
  double moveSome(size_t channel, size_t term, double count) {
    constexpr double kApart = 0.1; // in levels; spreads the moves over the block
    struct Move {
      double cost;
      size_t row;
    };
    const double up = count > 0 ? 1 : -1;
    std::vector<Move> moves;
    for (size_t i = channel; i < rows_; i += 3) {
      if (std::abs(static_cast<double>(q_.row(i)[term]) + up) > static_cast<double>(last_[term])) continue;
      const auto distance = static_cast<double>(r_.row(i)[term] * inverse_[term]);
      moves.push_back({kApart * ditherThreshold(i / 3) - up * distance, i});
    }
    std::ranges::stable_sort(moves, {}, &Move::cost);
    const auto most = static_cast<double>(moves.size());
    moves.resize(static_cast<size_t>(std::min(std::abs(count), most)));
    for (const Move& m : moves) move(m.row, term, static_cast<Real>(up));
    return up * static_cast<double>(moves.size());
  }

  size_t rows_, rank_;
  PaddedRows<Real> q_, c_, r_;
  std::vector<Real> inverse_, last_; // inverse diagonal of C; last level of each term
  std::vector<double> sums_;         // sums of P over lights
};

} // namespace

ChannelSums channelSums(const PaddedRows<float>& x, double white) {
  const size_t lights = x.columns();
  std::vector<double> perLight(3 * lights); // by channel and light: independent sums
  for (size_t i = 0; i < x.rows(); ++i)
    for (size_t l = 0; l < lights; ++l) perLight[i % 3 * lights + l] += double{x.row(i)[l]};
  const auto count = static_cast<double>(x.rows() / 3 * lights);
  ChannelSums channels;
  for (size_t c = 0; c < 3; ++c) {
    const double* const first = perLight.data() + c * lights;
    channels.sums[c] = std::accumulate(first, first + lights, 0.);
    channels.bounds[c] = count * channelMeanBound(channels.sums[c] / count, white);
  }
  return channels;
}

template <class Real>
bool fitLevels(const WeightedBlock<Real>& block, const ChannelSums& channels, StoredTerms& stored) {
  LevelFit<Real> fit(block, stored);
  fit.lowerError();
  bool kept = true;
  for (size_t c = 0; c < 3; ++c) kept = fit.keepSum(c, channels.sums[c], channels.bounds[c]) && kept;
  fit.store(stored);
  return kept;
}

template bool fitLevels(const WeightedBlock<float>&, const ChannelSums&, StoredTerms&);
template bool fitLevels(const WeightedBlock<double>&, const ChannelSums&, StoredTerms&);

} // namespace surflect::codec
