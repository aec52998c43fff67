// Pearson's chi-squared test over bins of the sphere: do samples of directions follow the stated density?
#pragma once

#include "render/stage/material/shading.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <vector>

namespace surflect::chi_squared {

// Q(a, x), the share of a gamma distribution beyond x: the series below a + 1, the continued fraction above.
// [Abramowitz, Stegun 1964, 6.5.29 and 6.5.31]
inline double upperGamma(double a, double x) {
  if (x <= 0) return 1;
  const double front = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (double n = a + 1; term > 1e-16 * sum; ++n) sum += term *= x / n;
    return 1 - front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, fraction = d;
  for (int i = 1; i < 10000; ++i) { // Lentz's algorithm
    const double numerator = -i * (i - a);
    b += 2;
    d = 1 / (b + numerator * d);
    c = b + numerator / c;
    fraction *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return front * fraction;
}

// Probability of a statistic at least as large if the counts follow the expectation. Bins that expect less
// than 5 are pooled.
inline double pValue(const std::vector<double>& counted, const std::vector<double>& expected) {
  double statistic = 0, pooledCount = 0, pooledExpectation = 0;
  int bins = 0;
  const auto add = [&](double count, double expectation) {
    statistic += (count - expectation) * (count - expectation) / expectation;
    ++bins;
  };
  for (size_t i = 0; i < counted.size(); ++i)
    if (expected[i] < 5) {
      pooledCount += counted[i];
      pooledExpectation += expected[i];
    } else
      add(counted[i], expected[i]);
  if (pooledExpectation >= 1)
    add(pooledCount, pooledExpectation);
  else if (pooledCount > 10) // samples where the density is nearly 0
    return 0;
  return bins < 2 ? 1 : upperGamma((bins - 1) / 2.0, statistic / 2);
}

// Significance of each of n tests, so that with probability `significance` at least one of them fails by
// chance.  [Sidak 1967]
inline double sidak(double significance, int tests) { return 1 - std::pow(1 - significance, 1.0 / tests); }

using Density = std::function<double(const material::ShadingDirection&)>;

inline material::ShadingDirection onSphere(double z, double phi) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// Integral over z0..z1 and phi0..phi1 by Gauss's 4 x 4 points. Rectangles are quartered until the sum of the
// quarters agrees with the whole; the first two quarterings are always made, so that no narrow peak is
// overlooked.
inline double integral(const Density& density, double z0, double z1, double phi0, double phi1,
                       double tolerance, int depth = 12) {
  constexpr double points[4] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                                0.8611363115940526};
  constexpr double weights[4] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461,
                                 0.3478548451374538};
  const auto once = [&](double za, double zb, double pa, double pb) {
    double sum = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        sum +=
            weights[i] * weights[j] *
            density(onSphere((za + zb + (zb - za) * points[i]) / 2, (pa + pb + (pb - pa) * points[j]) / 2));
    return sum * (zb - za) * (pb - pa) / 4;
  };
  const auto refined = [&](const auto& self, double za, double zb, double pa, double pb, double whole,
                           double error, int left) -> double {
    const double zm = (za + zb) / 2, pm = (pa + pb) / 2;
    const double parts[4] = {once(za, zm, pa, pm), once(zm, zb, pa, pm), once(za, zm, pm, pb),
                             once(zm, zb, pm, pb)};
    const double sum = parts[0] + parts[1] + parts[2] + parts[3];
    if (left == 0 || (left < depth - 1 && std::abs(sum - whole) < error)) return sum;
    return self(self, za, zm, pa, pm, parts[0], error / 2, left - 1) +
           self(self, zm, zb, pa, pm, parts[1], error / 2, left - 1) +
           self(self, za, zm, pm, pb, parts[2], error / 2, left - 1) +
           self(self, zm, zb, pm, pb, parts[3], error / 2, left - 1);
  };
  return refined(refined, z0, z1, phi0, phi1, once(z0, z1, phi0, phi1), tolerance, depth);
}

struct Result {
  double pValue = 0;
  double integral = 0; // of the density
  double returned = 0; // share of the samples
};

// Bins are even in solid angle; one more holds the samples that are not returned. `draw` is given a seeded
// generator.
inline Result compare(const std::function<std::optional<material::ShadingDirection>(std::mt19937&)>& draw,
                      const Density& density, int samples, unsigned seed) {
  constexpr int kHeights = 16, kAzimuths = 24;
  const auto count = static_cast<size_t>(kHeights * kAzimuths);
  std::vector<double> counted(count + 1, 0), expected(count + 1, 0);
  std::mt19937 random(seed);
  for (int i = 0; i < samples; ++i) {
    const auto w = draw(random);
    if (!w) {
      ++counted[count];
      continue;
    }
    double turn = std::atan2(w->y(), w->x()) / (2 * material::kPi);
    if (turn < 0) turn += 1;
    const int row = std::clamp(static_cast<int>((w->z() + 1) / 2 * kHeights), 0, kHeights - 1);
    const int column = std::clamp(static_cast<int>(turn * kAzimuths), 0, kAzimuths - 1);
    ++counted[static_cast<size_t>(row * kAzimuths + column)];
  }
  Result result;
  result.returned = 1 - counted[count] / samples;
  for (int row = 0; row < kHeights; ++row)
    for (int column = 0; column < kAzimuths; ++column) {
      const double mass = integral(density, 2.0 * row / kHeights - 1, 2.0 * (row + 1) / kHeights - 1,
                                   2 * material::kPi * column / kAzimuths,
                                   2 * material::kPi * (column + 1) / kAzimuths, 1e-5);
      expected[static_cast<size_t>(row * kAzimuths + column)] = samples * mass;
      result.integral += mass;
    }
  expected[count] = samples * std::max(0.0, 1 - result.integral);
  result.pValue = pValue(counted, expected);
  return result;
}

} // namespace surflect::chi_squared
