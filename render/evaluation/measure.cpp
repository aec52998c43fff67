#include "render/evaluation/measure.h"

#include "srf/image/color.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace surflect::evaluation {

namespace {

template <class A, class B> bool sameSize(const A& a, const B& b) {
  return a.width == b.width && a.height == b.height;
}

// Sums one PooledMean per row, top to bottom: the same result for any number of threads.
template <class OfRow> PooledMean overRows(int height, OfRow ofRow) {
  std::vector<PooledMean> rows(static_cast<size_t>(height));
  tbb::parallel_for(0, height, [&](int y) { rows[static_cast<size_t>(y)] = ofRow(y); });
  PooledMean total;
  for (const PooledMean& row : rows) total += row;
  return total;
}

template <class OfValue> image::Image mapped(const image::Image& image, OfValue ofValue) {
  image::Image result = image;
  std::transform(image.values.begin(), image.values.end(), result.values.begin(), ofValue);
  return result;
}

// Error of each difference of the first three channels over the mask.
template <class ErrorOf>
PooledMean overDifferences(const image::Image& a, const image::Image& b, const image::Mask& mask,
                           ErrorOf errorOf) {
  assert(sameSize(a, b) && sameSize(a, mask) && a.channels >= 3 && b.channels >= 3);
  return overRows(a.height, [&](int y) {
    PooledMean row;
    for (int x = 0; x < a.width; ++x) {
      if (!mask.inside[static_cast<size_t>(y) * static_cast<size_t>(a.width) + x]) continue;
      for (int k = 0; k < 3; ++k) row += {errorOf(static_cast<double>(a.at(x, y)[k]) - b.at(x, y)[k]), 1};
    }
    return row;
  });
}

// Local moments of two images under the SSIM window.
struct Moments {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double w, const Moments& m) {
    a += w * m.a;
    b += w * m.b;
    aa += w * m.aa;
    bb += w * m.bb;
    ab += w * m.ab;
  }
};

constexpr int kWindowRadius = 5;

std::array<double, 2 * kWindowRadius + 1> windowWeights() {
  constexpr double sigma = 1.5;
  std::array<double, 2 * kWindowRadius + 1> weights;
  for (int i = -kWindowRadius; i <= kWindowRadius; ++i)
    weights[i + kWindowRadius] = std::exp(-0.5 * i * i / (sigma * sigma));
  return weights;
}

// Weighted mean of value(i) over the window around `centre`, clipped to [0, size).
template <class Value> Moments windowed(int centre, int size, Value value) {
  static const auto weights = windowWeights();
  Moments sum;
  double weight = 0;
  for (int i = std::max(0, centre - kWindowRadius); i <= std::min(size - 1, centre + kWindowRadius); ++i) {
    const double w = weights[i - centre + kWindowRadius];
    sum.add(w, value(i));
    weight += w;
  }
  Moments mean;
  mean.add(1 / weight, sum);
  return mean;
}

// SSIM [Wang 2004, Eq. 13].
double similarity(const Moments& m) {
  constexpr double C1 = 0.01 * 0.01, C2 = 0.03 * 0.03;
  const double varianceA = m.aa - m.a * m.a;
  const double varianceB = m.bb - m.b * m.b;
  const double covariance = m.ab - m.a * m.b;
  return (2 * m.a * m.b + C1) * (2 * covariance + C2) /
         ((m.a * m.a + m.b * m.b + C1) * (varianceA + varianceB + C2));
}

double lumaAt(const image::Image& image, int x, int y) {
  const auto c = image.at(x, y);
  return static_cast<double>(image::luma({c[0], c[1], c[2]}));
}

} // namespace

double psnr(double meanSquaredError) { return -10 * std::log10(meanSquaredError); }

image::Image applyExposure(const image::Image& linear, double exposure) {
  return mapped(linear, [&](float value) {
    const double scaled = value * exposure;
    return std::isnan(scaled) ? 0.f : static_cast<float>(std::clamp(scaled, 0.0, 1.0));
  });
}

image::Image srgbEncoded(const image::Image& linear) { return mapped(linear, image::srgbFromLinear); }

bool isValid(const image::Image& truth, size_t texel) {
  const float* const values = &truth.values[texel * static_cast<size_t>(truth.channels)];
  return std::all_of(values, values + 3, [](float value) { return std::isfinite(value); });
}

size_t invalidTexels(const image::Image& truth) {
  size_t count = 0;
  for (size_t i = 0; i < truth.values.size() / static_cast<size_t>(truth.channels); ++i)
    count += !isValid(truth, i);
  return count;
}

image::Mask validPart(image::Mask mask, const image::Image& truth) {
  assert(sameSize(mask, truth) && truth.channels >= 3);
  for (size_t i = 0; i < mask.inside.size(); ++i) mask.inside[i] = mask.inside[i] && isValid(truth, i);
  return mask;
}

void blackenInvalid(image::Image& image, const image::Image& truth) {
  assert(sameSize(image, truth) && image.channels >= 3);
  const auto channels = static_cast<size_t>(image.channels);
  for (size_t i = 0; i < image.values.size() / channels; ++i)
    if (!isValid(truth, i)) std::fill_n(&image.values[channels * i], 3, 0.f);
}

PooledMean squaredError(const image::Image& a, const image::Image& b, const image::Mask& mask) {
  return overDifferences(a, b, mask, [](double difference) { return difference * difference; });
}

PooledMean absoluteError(const image::Image& a, const image::Image& b, const image::Mask& mask) {
  return overDifferences(a, b, mask, [](double difference) { return std::abs(difference); });
}

PooledMean alphaError(const image::Image& a, const image::Image& b) {
  assert(sameSize(a, b) && a.channels > 0 && b.channels > 0);
  constexpr float kLeast = 0.5f / 255;
  return overRows(a.height, [&](int y) {
    PooledMean row;
    for (int x = 0; x < a.width; ++x) {
      const float own = a.at(x, y).back(), other = b.at(x, y).back();
      if (std::max(own, other) >= kLeast) row += {std::abs(static_cast<double>(own) - other), 1};
    }
    return row;
  });
}

PooledMean noiseVariance(const image::Image& image, const image::Mask& mask) {
  assert(sameSize(image, mask) && image.channels >= 3);
  constexpr int kTaps[3] = {1, -2, 1};
  const image::Mask whole = image::eroded(mask, 2); // pixels with all eight neighbours in the mask
  return overRows(image.height, [&](int y) {
    PooledMean row;
    if (y == 0 || y == image.height - 1) return row;
    for (int x = 1; x < image.width - 1; ++x) {
      if (!whole.inside[static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x)])
        continue;
      for (size_t c = 0; c < 3; ++c) {
        double response = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx)
            response += kTaps[dy + 1] * kTaps[dx + 1] * static_cast<double>(image.at(x + dx, y + dy)[c]);
        row.sum += response * response / 36;
        ++row.count;
      }
    }
    return row;
  });
}

PooledMean structuralSimilarity(const image::Image& a, const image::Image& b, const image::Mask& mask) {
  assert(sameSize(a, b) && sameSize(a, mask) && a.channels >= 3 && b.channels >= 3);
  const auto index = [&](int x, int y) { return static_cast<size_t>(y) * static_cast<size_t>(a.width) + x; };
  std::vector<Moments> alongRows(mask.inside.size());
  tbb::parallel_for(0, a.height, [&](int y) {
    for (int x = 0; x < a.width; ++x)
      alongRows[index(x, y)] = windowed(x, a.width, [&](int i) -> Moments {
        const double va = lumaAt(a, i, y), vb = lumaAt(b, i, y);
        return {va, vb, va * va, vb * vb, va * vb};
      });
  });
  return overRows(a.height, [&](int y) {
    PooledMean row;
    for (int x = 0; x < a.width; ++x)
      if (mask.inside[index(x, y)])
        row += {similarity(windowed(y, a.height, [&](int i) { return alongRows[index(x, i)]; })), 1};
    return row;
  });
}

Difference& Difference::operator+=(const Difference& other) {
  squaredErrorLinear += other.squaredErrorLinear;
  squaredErrorSrgb += other.squaredErrorSrgb;
  similaritySrgb += other.similaritySrgb;
  absoluteErrorSrgb += other.absoluteErrorSrgb;
  absoluteErrorAlpha += other.absoluteErrorAlpha;
  return *this;
}

Difference compare(const image::Image& truth, const image::Image& rendered, double exposure) {
  assert(sameSize(truth, rendered) && truth.channels == 4 && rendered.channels == 4);
  const image::Mask mask =
      validPart(image::unionOf(image::objectMask(truth), image::objectMask(rendered)), truth);
  image::Image linearA = applyExposure(truth, exposure), linearB = applyExposure(rendered, exposure);
  blackenInvalid(linearA, truth);
  blackenInvalid(linearB, truth);
  const image::Image srgbA = srgbEncoded(linearA), srgbB = srgbEncoded(linearB);
  return {squaredError(linearA, linearB, mask), squaredError(srgbA, srgbB, mask),
          structuralSimilarity(srgbA, srgbB, mask), absoluteError(srgbA, srgbB, mask),
          alphaError(truth, rendered)};
}

} // namespace surflect::evaluation
