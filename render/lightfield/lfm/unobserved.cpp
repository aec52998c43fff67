#include "render/lightfield/lfm/unobserved.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace surflect::lfm {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<uint32_t> others(const std::vector<uint32_t>& some, size_t count) {
  std::vector<uint32_t> rest;
  for (size_t i = 0, next = 0; i < count; ++i)
    if (next < some.size() && some[next] == i)
      ++next;
    else
      rest.push_back(static_cast<uint32_t>(i));
  return rest;
}

// Least squares fit of the factors of a place (a sample or a cell) to its values at other places (cells or
// samples), whose factors are known. Channel i of a map is that of the colours c with c % channels = i.
class UnobservedFit {
public:
  using Map = std::vector<float> FactorTerm::*;

  UnobservedFit(Factors& factors, Map known, size_t knownChannels, Map sought, size_t soughtChannels,
                const std::vector<uint32_t>& places)
      : factors_(factors), known_(known), sought_(sought), knownChannels_(knownChannels),
        soughtChannels_(soughtChannels), places_(places) {
    for (size_t channel = 0; channel < soughtChannels_; ++channel) {
      MatrixXd gram = MatrixXd::Zero(terms(), terms());
      for (const uint32_t place : places_)
        for (size_t c = channel; c < 3; c += soughtChannels_) {
          const VectorXd row = knownAt(place, c);
          gram.noalias() += row * row.transpose();
        }
      inverses_.push_back(pseudoInverse(gram));
    }
  }

  // value(place, colour)
  template <class Value> void operator()(uint32_t at, bool isPositive, const Value& value) const {
    for (size_t channel = 0; channel < soughtChannels_; ++channel) {
      VectorXd right = VectorXd::Zero(terms());
      for (const uint32_t place : places_)
        for (size_t c = channel; c < 3; c += soughtChannels_) right += knownAt(place, c) * value(place, c);
      const VectorXd x = inverses_[channel] * right;
      for (size_t k = 0; k < factors_.terms.size(); ++k)
        (factors_.terms[k].*sought_)[soughtChannels_ * at + channel] =
            static_cast<float>(isPositive ? std::max(0.0, x[k]) : x[k]);
    }
  }

private:
  Eigen::Index terms() const { return static_cast<Eigen::Index>(factors_.terms.size()); }
  VectorXd knownAt(uint32_t place, size_t color) const {
    VectorXd row(terms());
    for (Eigen::Index k = 0; k < row.size(); ++k)
      row[k] = double{(factors_.terms[k].*known_)[knownChannels_ * place + color % knownChannels_]};
    return row;
  }
  static MatrixXd pseudoInverse(const MatrixXd& gram) {
    if (gram.rows() == 0) return gram;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
    const double largest = solver.eigenvalues().maxCoeff();
    const VectorXd inverse =
        solver.eigenvalues().unaryExpr([&](double value) { return value > 1e-10 * largest ? 1 / value : 0; });
    return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
  }

  Factors& factors_;
  Map known_, sought_;
  size_t knownChannels_, soughtChannels_;
  const std::vector<uint32_t>& places_;
  std::vector<MatrixXd> inverses_;
};

} // namespace

void projectUnobserved(const LightFieldMatrix& matrix, const Observed& observed, bool isPositive,
                       Factors& factors) {
  const size_t us = surfaceChannels(factors.layout), vs = viewChannels(factors.layout);
  const std::vector<uint32_t> samples = others(observed.samples, matrix.samples);
  const std::vector<uint32_t> cells = others(observed.cells, matrix.cells);
  const auto value = [&](size_t sample, size_t cell, size_t c) {
    const float number = matrix.radiance[3 * (sample * matrix.cells + cell) + c];
    return std::isfinite(number) ? double{number} : 0;
  };
  const auto rest = [&](size_t sample, size_t cell, size_t c) {
    return value(sample, cell, c) - (factors.mean.empty() ? 0 : double{factors.mean[3 * sample + c]});
  };

  std::vector<uint32_t> all(matrix.cells);
  for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<uint32_t>(i);
  const std::vector<uint32_t>& seen = observed.cells.empty() ? all : observed.cells;
  for (const uint32_t sample : samples)
    for (size_t c = 0; c < 3 && !factors.mean.empty() && !seen.empty(); ++c) {
      double sum = 0;
      for (const uint32_t cell : seen) sum += value(sample, cell, c);
      factors.mean[3 * sample + c] = static_cast<float>(sum / static_cast<double>(seen.size()));
    }
  if (factors.terms.empty()) return;

  const UnobservedFit fitSample(factors, &FactorTerm::view, vs, &FactorTerm::surface, us, observed.cells);
  for (const uint32_t sample : samples)
    fitSample(sample, isPositive, [&](size_t cell, size_t c) { return rest(sample, cell, c); });
  const UnobservedFit fitCell(factors, &FactorTerm::surface, us, &FactorTerm::view, vs, observed.samples);
  for (const uint32_t cell : cells)
    fitCell(cell, isPositive, [&](size_t sample, size_t c) { return rest(sample, cell, c); });
}

} // namespace surflect::lfm
