// Kriging of photographs: weights of (camera, light) pairs for a requested pair of directions at a surfel,
// from how fast reflectance is expected to change with each direction.
//
//   C_ij = M(|x_i - x_j|) + (i = j ? nu_i : 0),   c_i = M(|x_i - x|)
//   w = C^-1 (c + mu 1),   mu so that sum w = 1                      [Matheron 1963; Rasmussen 2006, §2.2]
//   M(d) = (1 + sqrt(5) d + 5/3 d^2) exp(-sqrt(5) d)                 [Rasmussen 2006, Eq. 4.17]
//
// Symbols: x = (h / sigma_h, l / sigma_l, v / sigma_v, s / sigma_s) place of a pair, with the unit directions
// h of the half vector, l to the light and v to the viewer, and the shadow state s, the part of the light
// that reaches the surfel; C covariance of the photographs (Matern 5/2), c that with the requested pair, nu_i
// nugget: the variance of a photograph's own error, mu Lagrange multiplier.
//
// Unlike its ULR weight [Weyrich 2005, §5.2], the kriging weight of a photograph depends on camera and light
// together: a pair with the requested half vector shows the requested highlight, wherever its camera and
// light are.
//
// [Matheron 1963] Matheron: Principles of Geostatistics, Economic Geology 58.
// [Rasmussen 2006] Rasmussen, Williams: Gaussian Processes for Machine Learning.
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
#pragma once

#include "srf/weights/ulr.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::weights {

// Change of direction, as a chord, over which reflectance stays alike.
struct KrigingScales {
  float half = 0.2f, light = 1, view = 2, shadow = 0.4f;
  friend bool operator==(const KrigingScales&, const KrigingScales&) = default;
};

// Scales for a requested shadow state. `halfScale`, that of the model, is the scale of half vectors for lit
// surfels. A surfel in shadow has no highlight of the light, and shows light from its surroundings, which
// changes evenly with all directions; its scales are fixed.
KrigingScales scalesFor(float halfScale, float reached);

// x: three coordinates each of half vector, light and view, and the shadow state; divided by their scales.
using PairPlace = std::array<float, 10>;

// Unit half vector of two unit directions. Where their sum is shorter than kOppositeHalf it is shortened, to
// 0 for opposite directions, so that it changes continuously.
inline constexpr float kOppositeHalf = 0.1f;
inline Vec3<float> halfVector(const Vec3<float>& light, const Vec3<float>& view) {
  const Vec3<float> sum = light + view;
  return 1 / std::max(sum.norm(), kOppositeHalf) * sum;
}

inline PairPlace pairPlace(const Direction3<AcquisitionSpace>& light,
                           const Direction3<AcquisitionSpace>& view, float shadow,
                           const KrigingScales& scales) {
  const Vec3<float> h = 1 / scales.half * halfVector(light.raw(), view.raw());
  const Vec3<float> l = 1 / scales.light * light.raw(), v = 1 / scales.view * view.raw();
  return {h[0], h[1], h[2], l[0], l[1], l[2], v[0], v[1], v[2], shadow / scales.shadow};
}

// |a - b|^2
inline float squaredDistance(const PairPlace& a, const PairPlace& b) {
  float sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

// Penalty of a pair before division by its confidence. `squared` is its squared distance without shadow
// states, `statesApart` the difference of the shadow states in scales: pairs of another shadow state are
// penalised, but keep their order by angle.
inline float krigingPenalty(float squared, float statesApart) {
  return std::sqrt(squared) * (1 + statesApart);
}
inline float krigingPenalty(const PairPlace& a, const PairPlace& b) {
  const float apart = std::abs(a.back() - b.back());
  return krigingPenalty(std::max(0.f, squaredDistance(a, b) - apart * apart), apart);
}

// M(d), of the squared distance.
template <class T> T matern52(T squared) {
  const T d = std::sqrt(5 * squared);
  return (1 + d + d * d / 3) * std::exp(-d);
}

// nu_i of a photograph at `share` (0..1) of the penalty at which it leaves the blend, and with the given
// confidence (0..1). It grows to infinity as share nears 1 or confidence 0, so that photographs fade out of
// the blend. The least nugget is that of noise: a photograph of confidence 1 at exactly the requested pair
// has weight 1 within 3e-3.
inline float nuggetOf(float share, float confidence) {
  constexpr float kNoise = 5e-4f, kGrowth = 0.1f, kSmall = 1e-6f;
  const float odds = share / std::max(1 - share, kSmall);
  return kNoise + kGrowth * odds * odds + 1 / std::max(confidence, kSmall) - 1;
}

struct KrigingSample {
  uint32_t index = 0; // of the pair
  PairPlace place;
  float nugget = 0; // nu_i
};

// Requests whose weights are computed together, eight at a time in vector lanes. Every instruction set gives
// the same bits. Costs about n^3 / 6 + 15 n^2 products for requests of n samples.
class KrigingBatch {
public:
  void clear() { count_ = 0; }
  // Begins a request; its samples follow. Returns its number.
  size_t ask(const PairPlace& asked);
  // Adds a sample, one of at most kMaxBlended, to the request begun last.
  void add(const KrigingSample& sample);

  // Computes all weights.
  void solve();
  // Computes weights of simple kriging, for values whose mean is 0: w = C^-1 c [Rasmussen 2006, Eq. 2.25].
  // They may be negative, and their sum falls from 1 to 0 with the distance from all samples.
  void solveSimple();

  // Weights of a request: those above 0, scaled to the sum 1, so that radiance stays positive. Empty without
  // samples.
  BlendSet positiveWeights(size_t request) const;
  // Weights of all its samples.
  BlendSet weights(size_t request) const;

  static constexpr size_t kLanes = 8;
  template <class T> using Lanes = std::array<T, kLanes>;
  // Requests, one a lane. Lanes with fewer samples than others have samples of infinite nugget.
  struct Group {
    size_t most = 0; // samples in any lane
    Lanes<size_t> count{};
    alignas(32) std::array<Lanes<float>, 10> asked{};
    alignas(32) std::array<std::array<Lanes<float>, 10>, kMaxBlended> places{};
    alignas(32) std::array<Lanes<float>, kMaxBlended> nuggets, weights;
    std::array<Lanes<uint32_t>, kMaxBlended> indices;
  };

private:
  std::vector<Group> groups_; // the first (count_ + kLanes - 1) / kLanes are in use
  size_t count_ = 0;
};

// w of at most kMaxBlended samples, by a batch of one.
BlendSet krigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked);
BlendSet simpleKrigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked);

// Same weights by the whole system with its multiplier, in double precision: the reference of krigingWeights.
std::vector<double> krigingWeightsReference(std::span<const KrigingSample> samples, const PairPlace& asked);

// Reference of simpleKrigingWeights.
std::vector<double> simpleKrigingWeightsReference(std::span<const KrigingSample> samples,
                                                  const PairPlace& asked);

} // namespace surflect::weights
