// Symbols: S the stored images, weighted; A their coefficients, weighted; G = S' S; B = S' (V X W).
#include "srf/codec/block_fit.h"

#include "srf/codec/block.h"
#include "srf/codec/block_kernels.h"
#include "surfel/math/padded_rows.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace surflect::codec {

// Fits the levels of eigenimages by coordinate descent on |V (X - X') W|^2, then moves single levels until
// the sum of each channel keeps its bound.
//
// Symbols: Q the levels of images, rows (texel, channel), columns terms; P the radiance of one level, rows
//          terms, columns lights, so that X' = Q P; W the weights of lights; C = P W^2 P';
//          R = (X - X') W^2 P'. The error is least if level q_ik moves by r_ik / c_kk.
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

namespace {

// Clipping of a quantiser: its last level stands for `clip` times the largest value. At 4 bits, levels become
// finer if the largest values are clipped, which is worth the loss; at 8 bits, a factor slightly above 1 may
// bring a uniform channel nearer to a level. Coefficients are never clipped, as the largest belong to
// highlights: they use the first entry of each precision.
struct Clipping {
  size_t precision; // index into precisions
  double clip;
};
constexpr std::array<Clipping, roundings> kClippings = {
    {{0, 1}, {1, 1}, {2, 1}, {1, 1.05}, {1, 1.1}, {2, 0.85}, {2, 0.7}, {2, 0.6}, {2, 0.5}}};

float asStored(float coefficient, CoefficientType type) {
  if (type == CoefficientType::single) return coefficient;
  return imath_half_to_float(imath_float_to_half(coefficient));
}

template <class Real> Real largestOf(const Real* values, size_t count) {
  std::array<Real, 8> peaks{}; // eight independent maxima, without a dependency chain
  for (size_t i = 0; i + 8 <= count; i += 8)
    for (size_t k = 0; k < 8; ++k) peaks[k] = std::max(peaks[k], std::abs(values[i + k]));
  for (size_t i = count / 8 * 8; i < count; ++i) peaks[0] = std::max(peaks[0], std::abs(values[i]));
  return *std::ranges::max_element(peaks);
}

// Rounds values to levels, of which the last stands for clip times the largest value. Returns what the last
// level stands for.
template <class Real> Real toLevels(const Real* values, size_t count, int bits, Real clip, Real* levels) {
  const Real peak = clip * largestOf(values, count);
  const auto last = static_cast<Real>(levelsOf(bits));
  const Real scale = peak > 0 ? last / peak : 0;
  for (size_t i = 0; i < count; ++i)
    levels[i] = std::max(std::min(values[i] * scale, last), -last) + wholeShift<Real> - wholeShift<Real>;
  return peak;
}

// Inverse of a Gram matrix; the pseudo-inverse if it is nearly singular.
Eigen::MatrixXd inverseOf(const Eigen::MatrixXd& gram) {
  const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd unit = scale.asDiagonal() * gram * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(unit);
  const bool sound = cholesky.info() == Eigen::Success && cholesky.matrixLLT().diagonal().minCoeff() > 1e-3;
  const Eigen::MatrixXd inverse =
      sound ? Eigen::MatrixXd(cholesky.solve(Eigen::MatrixXd::Identity(gram.rows(), gram.cols())))
            : Eigen::MatrixXd(unit.completeOrthogonalDecomposition().pseudoInverse());
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

template <class Real> PaddedRows<Real> padded(const Eigen::MatrixXd& m) {
  PaddedRows<Real> result(static_cast<size_t>(m.rows()), static_cast<size_t>(m.cols()));
  for (size_t i = 0; i < result.rows(); ++i)
    for (size_t j = 0; j < result.columns(); ++j)
      result.row(i)[j] = static_cast<Real>(m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
  return result;
}

} // namespace

template <class Real>
BlockFit<Real>::BlockFit(const WeightedBlock<Real>& block, const TruncatedSvd<Real>& factors)
    : block_(block), factors_(factors),
      stored_(precisions.size() * factors.energies.size(), block.values.rows()),
      products_(stored_.rows(), block.values.columns()), gram_(stored_.rows(), stored_.rows()) {
  images_ = rounded(factors.left, block.rows, roundings);
  lights_ = rounded(factors.right, block.lights, precisions.size());
  std::ranges::fill(lights_[at(16)].squaredErrors, Real{0});
}

template <class Real>
typename BlockFit<Real>::AtPrecisions BlockFit<Real>::rounded(const PaddedRows<Real>& values,
                                                              const std::vector<Real>& weights,
                                                              size_t clippings) const {
  const size_t terms = values.stride();
  std::vector<Real> inverse(weights.size()), errors(roundings * terms);
  for (size_t i = 0; i < weights.size(); ++i) inverse[i] = 1 / weights[i];
  Rounding<Real> job{values.row(0), values.rows(), terms, weights.data(), inverse.data(), {}, {},
                     errors.data()};
  for (size_t r = 0; r < roundings; ++r) {
    job.last[r] = static_cast<Real>(levelsOf(precisions[kClippings[r].precision]));
    job.clip[r] = static_cast<Real>(kClippings[r].clip);
  }
  roundingErrors(job);

  AtPrecisions best;
  for (size_t r = 0; r < clippings; ++r) {
    Rounded& rounded = best[kClippings[r].precision];
    const Real* const of = errors.data() + r * terms;
    if (rounded.clips.empty()) {
      rounded.squaredErrors.assign(of, of + terms);
      rounded.clips.assign(terms, job.clip[r]);
    }
    for (size_t k = 0; k < terms; ++k) {
      if (!(of[k] < rounded.squaredErrors[k])) continue;
      rounded.squaredErrors[k] = of[k];
      rounded.clips[k] = job.clip[r];
    }
  }
  return best;
}

template <class Real> PaddedRows<Real> BlockFit<Real>::levelsOfImage(const ChosenTerm& term) const {
  const size_t rows = block_.values.rows();
  PaddedRows<Real> levels(1, rows);
  for (size_t i = 0; i < rows; ++i) levels.row(0)[i] = factors_.left.row(i)[term.term] / block_.rows[i];
  toLevels(levels.row(0), rows, term.bits, images_[at(term.bits)].clips[term.term], levels.row(0));
  return levels;
}

template <class Real> size_t BlockFit<Real>::placeOf(const ChosenTerm& term) const {
  const auto same = [&](const ChosenTerm& t) { return t.term == term.term && t.bits == term.bits; };
  return static_cast<size_t>(std::ranges::find_if(places_, same) - places_.begin());
}

template <class Real> std::vector<size_t> BlockFit<Real>::placed(const std::vector<ChosenTerm>& terms) {
  const size_t first = places_.size(), rows = block_.values.rows();
  std::vector<size_t> places;
  for (const ChosenTerm& term : terms) {
    const size_t place = places.emplace_back(placeOf(term));
    if (place < places_.size()) continue;
    places_.push_back(term);
    const Real* const levels = levels_.emplace_back(levelsOfImage(term)).row(0);
    Real* const image = stored_.row(place);
    const Real step = 1 / static_cast<Real>(levelsOf(term.bits));
    for (size_t i = 0; i < rows; ++i) image[i] = levels[i] * step * block_.rows[i];
  }
  if (first == places_.size()) return places;
  const PaddedRows<Real>& x = block_.values;
  multiply(MatrixProduct<Real>{stored_.row(first), stored_.stride(), 1, x.row(0), x.stride(),
                               products_.row(first), products_.stride(), places_.size() - first, rows,
                               products_.stride(), false});
  using Image = Eigen::Map<const Eigen::VectorX<Real>>;
  const auto size = static_cast<Eigen::Index>(rows);
  for (size_t i = first; i < places_.size(); ++i)
    for (size_t j = 0; j <= i; ++j) {
      const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
      gram_(a, b) = gram_(b, a) =
          static_cast<double>(Image(stored_.row(i), size).dot(Image(stored_.row(j), size)));
    }
  return places;
}

template <class Real>
typename BlockFit<Real>::Solution BlockFit<Real>::solved(const std::vector<ChosenTerm>& terms,
                                                         CoefficientType type) {
  Solution solution{{type, {}}, factors_.energy};
  if (terms.empty()) return solution;
  const size_t lights = block_.values.columns();
  const std::vector<size_t> places = placed(terms);
  const Eigen::MatrixXd gram = gram_(places, places);
  PaddedRows<Real> b(terms.size(), lights);
  for (size_t k = 0; k < terms.size(); ++k)
    std::copy_n(products_.row(places[k]), products_.stride(), b.row(k));
  PaddedRows<Real> a = product(padded<Real>(inverseOf(gram)), b);

  std::vector<Real> row(lights);
  for (size_t k = 0; k < terms.size(); ++k) {
    StoredTerm& stored = solution.stored.terms.emplace_back();
    stored.bits = terms[k].bits;
    Real* const weighted = a.row(k);
    for (size_t l = 0; l < lights; ++l) row[l] = weighted[l] / block_.lights[l];
    if (stored.bits == 16) {
      stored.coefficients.resize(lights);
      for (size_t l = 0; l < lights; ++l) {
        stored.coefficients[l] = asStored(static_cast<float>(row[l]), type);
        weighted[l] = static_cast<Real>(stored.coefficients[l]) * block_.lights[l];
      }
      continue;
    }
    stored.peak = static_cast<float>(toLevels(row.data(), lights, stored.bits, Real{1}, row.data()));
    stored.lightLevels.assign(row.begin(), row.end());
    const Real step = static_cast<Real>(stored.peak) / static_cast<Real>(levelsOf(stored.bits));
    for (size_t l = 0; l < lights; ++l) weighted[l] = row[l] * step * block_.lights[l];
  }
  // |V X W - S A|^2 = |V X W|^2 - sum over A of A (2 B - G A)
  const PaddedRows<Real> ga = product(padded<Real>(gram), a);
  for (size_t k = 0; k < terms.size(); ++k) {
    double gained = 0;
    for (size_t l = 0; l < lights; ++l)
      gained += static_cast<double>(a.row(k)[l] * (2 * b.row(k)[l] - ga.row(k)[l]));
    solution.squaredError -= gained;
  }
  return solution;
}

template <class Real>
void BlockFit<Real>::addLevels(const std::vector<ChosenTerm>& terms, StoredTerms& stored) const {
  for (size_t k = 0; k < terms.size(); ++k) {
    const Real* const levels = levels_[placeOf(terms[k])].row(0);
    stored.terms[k].levels.assign(levels, levels + block_.values.rows());
  }
}

template class BlockFit<float>;
template class BlockFit<double>;

} // namespace surflect::codec
