#include "srf/weights/kriging.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>

namespace surflect::weights {

KrigingScales scalesFor(float halfScale, float reached) {
  constexpr KrigingScales shadow{.half = 0.8f, .light = 1, .view = 1};
  const KrigingScales lit{.half = halfScale};
  const auto between = [&](float ofShadow, float ofLight) { // 1 / scale^2 is linear in the state
    return 1 / std::sqrt((1 - reached) / (ofShadow * ofShadow) + reached / (ofLight * ofLight));
  };
  return {between(shadow.half, lit.half), between(shadow.light, lit.light), between(shadow.view, lit.view),
          lit.shadow};
}

// With S = diag(1 / sqrt(1 + nu_i)), the matrix S C S has a diagonal of 1, however large the nuggets are:
//
//   L L^T = S C S,   y = L^-1 S 1,   z = L^-1 S c,   mu = (1 - y . z) / (y . y),   w = S L^-T (z + mu y)
BlendSet krigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked) {
  assert(samples.size() <= kMaxBlended);
  const size_t n = samples.size();
  std::array<std::array<float, kMaxBlended>, kMaxBlended> factor; // L
  std::array<float, kMaxBlended> scale, y, z;
  BlendSet weights;
  if (n == 0) return weights;
  for (size_t i = 0; i < n; ++i) scale[i] = 1 / std::sqrt(1 + samples[i].nugget);
  float yy = 0, yz = 0;
  for (size_t i = 0; i < n; ++i) {
    float own = 1;
    y[i] = scale[i];
    z[i] = scale[i] * matern52(squaredDistance(samples[i].place, asked));
    for (size_t j = 0; j < i; ++j) {
      float sum = scale[i] * scale[j] * matern52(squaredDistance(samples[i].place, samples[j].place));
      for (size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      factor[i][j] = sum * factor[j][j];
      own -= factor[i][j] * factor[i][j];
      y[i] -= factor[i][j] * y[j];
      z[i] -= factor[i][j] * z[j];
    }
    // Pairs at one place leave no less than the noise.
    constexpr float kLeast = 1e-4f;
    factor[i][i] = 1 / std::sqrt(std::max(own, kLeast)); // inverse
    y[i] *= factor[i][i];
    z[i] *= factor[i][i];
    yy += y[i] * y[i];
    yz += y[i] * z[i];
  }
  const float mu = (1 - yz) / yy;
  std::array<float, kMaxBlended> w;
  for (size_t i = n; i-- > 0;) {
    float sum = z[i] + mu * y[i];
    for (size_t k = i + 1; k < n; ++k) sum -= factor[k][i] * w[k];
    w[i] = sum * factor[i][i];
  }
  float sum = 0;
  for (size_t i = 0; i < n; ++i) {
    w[i] = std::max(0.f, scale[i] * w[i]);
    sum += w[i];
  }
  for (size_t i = 0; i < n; ++i)
    if (w[i] > 0) weights.push({samples[i].index, w[i] / sum});
  return weights;
}

std::vector<double> krigingWeightsReference(std::span<const KrigingSample> samples, const PairPlace& asked) {
  const auto covariance = [](const PairPlace& a, const PairPlace& b) {
    double squared = 0;
    for (size_t i = 0; i < a.size(); ++i) squared += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
    return matern52(squared);
  };
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Ones(n + 1, n + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Ones(n + 1);
  system(n, n) = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const KrigingSample& sample = samples[static_cast<size_t>(i)];
    right(i) = covariance(sample.place, asked);
    for (Eigen::Index j = 0; j < n; ++j)
      system(i, j) = covariance(sample.place, samples[static_cast<size_t>(j)].place);
    system(i, i) += sample.nugget;
  }
  const Eigen::VectorXd weights = system.fullPivLu().solve(right).head(n).cwiseMax(0);
  const double sum = weights.sum();
  std::vector<double> all;
  for (const double weight : weights) all.push_back(weight / sum);
  return all;
}

} // namespace surflect::weights
