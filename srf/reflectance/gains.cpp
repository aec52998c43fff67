#include "srf/reflectance/gains.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::reflectance {

namespace {

std::array<double, 3> arrayOf(const Rgb& x, float white) {
  return {double{x.r} / white, double{x.g} / white, double{x.b} / white};
}

float gainOf(double products, double squares) {
  return std::clamp(static_cast<float>((products + kGainPrior) / (squares + kGainPrior)), kLeastGain,
                    kGreatestGain);
}

template <class Use> void forEachSurfel(const Photographs& photographs, const Use& use) {
  constexpr size_t kAtOnce = 64;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, photographs.surfels(), kAtOnce), [&](const auto& range) {
    for (size_t surfel = range.begin(); surfel < range.end(); ++surfel)
      use(surfel, photographs.first[surfel], photographs.first[surfel + 1]);
  });
}

} // namespace

GainSums::Terms GainSums::termsOf(const Rgb& measured, const Rgb& predicted) const {
  constexpr double kDark = 0.1;
  const std::array<double, 3> y = arrayOf(measured, white_), t = arrayOf(predicted, white_);
  Terms terms;
  for (size_t c = 0; c < 3; ++c) {
    const double weight = 1 / ((kDark + t[c]) * (1 + y[c] * y[c]));
    terms.products[c] = weight * y[c] * t[c];
    terms.squares[c] = weight * t[c] * t[c];
  }
  return terms;
}

void GainSums::add(const Rgb& measured, const Rgb& predicted) {
  const Terms terms = termsOf(measured, predicted);
  for (size_t c = 0; c < 3; ++c) {
    products_[c] += terms.products[c];
    squares_[c] += terms.squares[c];
  }
}

Rgb GainSums::gain() const {
  return {gainOf(products_[0], squares_[0]), gainOf(products_[1], squares_[1]),
          gainOf(products_[2], squares_[2])};
}

Rgb GainSums::gainWithout(const Rgb& measured, const Rgb& predicted) const {
  const auto [products, squares] = termsOf(measured, predicted);
  return {gainOf(products_[0] - products[0], squares_[0] - squares[0]),
          gainOf(products_[1] - products[1], squares_[1] - squares[1]),
          gainOf(products_[2] - products[2], squares_[2] - squares[2])};
}

std::vector<Rgb> gainsOf(const Photographs& photographs, std::span<const Rgb> predicted, float white) {
  assert(predicted.size() == photographs.size());
  std::vector<Rgb> gains(photographs.surfels());
  forEachSurfel(photographs, [&](size_t surfel, size_t begin, size_t end) {
    GainSums sums(white);
    for (size_t i = begin; i < end; ++i) sums.add(photographs.reflectance[i], predicted[i]);
    gains[surfel] = sums.gain();
  });
  return gains;
}

float logError(const Rgb& predicted, const Rgb& measured, float white) {
  constexpr double kDark = 0.03;
  const std::array<double, 3> x = arrayOf(predicted, white), y = arrayOf(measured, white);
  double sum = 0;
  for (size_t c = 0; c < 3; ++c) {
    const double difference = std::log((kDark + std::max(0.0, x[c])) / (kDark + std::max(0.0, y[c])));
    sum += difference * difference;
  }
  return static_cast<float>(sum);
}

std::vector<float> leftOutErrors(const Photographs& photographs, std::span<const Rgb> predicted,
                                 float white) {
  assert(predicted.size() == photographs.size());
  std::vector<float> errors(photographs.surfels());
  forEachSurfel(photographs, [&](size_t surfel, size_t begin, size_t end) {
    GainSums sums(white);
    for (size_t i = begin; i < end; ++i) sums.add(photographs.reflectance[i], predicted[i]);
    double sum = 0;
    for (size_t i = begin; i < end; ++i) {
      const Rgb& measured = photographs.reflectance[i];
      sum += logError(sums.gainWithout(measured, predicted[i]) * predicted[i], measured, white);
    }
    errors[surfel] = end > begin ? static_cast<float>(sum / static_cast<double>(end - begin)) : 0;
  });
  return errors;
}

} // namespace surflect::reflectance
