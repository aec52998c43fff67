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

namespace {

// L, y and z, with S = diag(1 / sqrt(1 + nu_i)). The matrix S C S has a diagonal of 1, however large the
// nuggets are:
//
//   L L^T = S C S,   y = L^-1 S 1,   z = L^-1 S c
struct Factored {
  size_t n;
  std::array<std::array<float, kMaxBlended>, kMaxBlended> factor; // L, with inverse diagonal
  std::array<float, kMaxBlended> scale, y, z;                     // S

  Factored(std::span<const KrigingSample> samples, const PairPlace& asked) : n(samples.size()) {
    assert(n <= kMaxBlended);
    for (size_t i = 0; i < n; ++i) scale[i] = 1 / std::sqrt(1 + samples[i].nugget);
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
      factor[i][i] = 1 / std::sqrt(std::max(own, kLeast));
      y[i] *= factor[i][i];
      z[i] *= factor[i][i];
    }
  }

  // S L^-T (z + mu y)
  std::array<float, kMaxBlended> weights(float mu) const {
    std::array<float, kMaxBlended> w;
    for (size_t i = n; i-- > 0;) {
      float sum = z[i] + mu * y[i];
      for (size_t k = i + 1; k < n; ++k) sum -= factor[k][i] * w[k];
      w[i] = sum * factor[i][i];
    }
    for (size_t i = 0; i < n; ++i) w[i] *= scale[i];
    return w;
  }
};

double covariance(const PairPlace& a, const PairPlace& b) {
  double squared = 0;
  for (size_t i = 0; i < a.size(); ++i) squared += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return matern52(squared);
}

// C
Eigen::MatrixXd covariances(std::span<const KrigingSample> samples) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd matrix(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const KrigingSample &a = samples[static_cast<size_t>(i)], &b = samples[static_cast<size_t>(j)];
      matrix(i, j) = covariance(a.place, b.place) + (i == j ? double{a.nugget} : 0);
    }
  return matrix;
}

// c
Eigen::VectorXd covariances(std::span<const KrigingSample> samples, const PairPlace& asked) {
  Eigen::VectorXd vector(static_cast<Eigen::Index>(samples.size()));
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    vector(i) = covariance(samples[static_cast<size_t>(i)].place, asked);
  return vector;
}

} // namespace

//   mu = (1 - y . z) / (y . y)
BlendSet krigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked) {
  BlendSet weights;
  if (samples.empty()) return weights;
  const Factored system(samples, asked);
  const size_t n = samples.size();
  float yy = 0, yz = 0;
  for (size_t i = 0; i < n; ++i) {
    yy += system.y[i] * system.y[i];
    yz += system.y[i] * system.z[i];
  }
  std::array<float, kMaxBlended> w = system.weights((1 - yz) / yy);
  float sum = 0;
  for (size_t i = 0; i < n; ++i) {
    w[i] = std::max(0.f, w[i]);
    sum += w[i];
  }
  for (size_t i = 0; i < n; ++i)
    if (w[i] > 0) weights.push({samples[i].index, w[i] / sum});
  return weights;
}

BlendSet simpleKrigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked) {
  const std::array<float, kMaxBlended> w = Factored(samples, asked).weights(0);
  BlendSet weights;
  for (size_t i = 0; i < samples.size(); ++i) weights.push({samples[i].index, w[i]});
  return weights;
}

std::vector<double> krigingWeightsReference(std::span<const KrigingSample> samples, const PairPlace& asked) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Ones(n + 1, n + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Ones(n + 1);
  system(n, n) = 0;
  system.topLeftCorner(n, n) = covariances(samples);
  right.head(n) = covariances(samples, asked);
  const Eigen::VectorXd weights = system.fullPivLu().solve(right).head(n).cwiseMax(0);
  const double sum = weights.sum();
  std::vector<double> all;
  for (const double weight : weights) all.push_back(weight / sum);
  return all;
}

std::vector<double> simpleKrigingWeightsReference(std::span<const KrigingSample> samples,
                                                  const PairPlace& asked) {
  const Eigen::VectorXd weights = covariances(samples).fullPivLu().solve(covariances(samples, asked));
  return {weights.begin(), weights.end()};
}

} // namespace surflect::weights
