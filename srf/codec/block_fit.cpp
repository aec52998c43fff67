// Symbols: S the stored images, weighted; A their coefficients, weighted; G = S' S; B = S' (V X W).
#include "srf/codec/block_fit.h"

#include "srf/codec/block_kernels.h"
#include "surfel/math/padded_products.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Imath/half.h>

#include <algorithm>
#include <cmath>

namespace surflect::codec {

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
