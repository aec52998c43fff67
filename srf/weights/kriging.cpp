#include "srf/weights/kriging.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "srf/weights/kriging.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::weights {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, KrigingBatch::kLanes>;
using Lanes = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr size_t kWidth = hn::MaxLanes(Tag());

HWY_INLINE Lanes number(float x) { return hn::Set(kTag, x); }

// e^-d for d >= 0, within 2^-22 + 2^-23 d of its value; d counts as at most 80. A power of two, times the
// series of 2^f for the rest f. Without fused products, which not all instruction sets have.
HWY_INLINE Lanes exponential(Lanes d) {
  const Lanes x = hn::Min(d, number(80)) * number(-1.44269504f), whole = hn::Round(x), f = x - whole;
  Lanes p = number(1.52527338e-5f); // ln(2)^k / k!, for k from 7 to 0
  for (const float factor :
       {1.54035304e-4f, 1.33335581e-3f, 9.61812911e-3f, 5.55041087e-2f, 0.240226507f, 0.693147181f, 1.f})
    p = p * f + number(factor);
  const hn::RebindToSigned<Tag> integers;
  const auto exponent = hn::ShiftLeft<23>(hn::ConvertTo(integers, whole));
  return hn::BitCast(kTag, hn::BitCast(integers, p) + exponent);
}

// M(d), of the squared distance.
HWY_INLINE Lanes matern52(Lanes squared) {
  const Lanes d = hn::Sqrt(number(5) * squared);
  return (number(1) + d + d * d * number(1.f / 3)) * exponential(d);
}

using StoredPlace = std::array<KrigingBatch::Lanes<float>, 10>;
HWY_INLINE Lanes load(const KrigingBatch::Lanes<float>& all, size_t lane) {
  return hn::Load(kTag, all.data() + lane);
}
HWY_INLINE Lanes squaredDistance(const StoredPlace& a, const StoredPlace& b, size_t lane) {
  Lanes sum = number(0);
  for (size_t i = 0; i < a.size(); ++i) {
    const Lanes apart = load(a[i], lane) - load(b[i], lane);
    sum = sum + apart * apart;
  }
  return sum;
}

// w of the requests in some lanes, by L, y and z, with S = diag(1 / sqrt(1 + nu_i)). The matrix S C S has a
// diagonal of 1, however large the nuggets are:
//
//   L L^T = S C S,   y = L^-1 S 1,   z = L^-1 S c
//   w = S L^-T (z + mu y),   mu = (1 - y . z) / (y . y), or 0 for simple kriging
//
// A sample of infinite nugget has a row of S, y, z and w that is 0.
HWY_INLINE void solveLanes(KrigingBatch::Group& group, size_t lane, bool isSimple) {
  constexpr float kLeast = 1e-4f; // pairs at one place leave no less than the noise
  const size_t n = group.most;
  const Lanes one = number(1);
  Lanes scale[kMaxBlended], y[kMaxBlended], z[kMaxBlended];
  Lanes factor[kMaxBlended][kMaxBlended]; // L, with inverse diagonal
  Lanes yy = number(0), yz = number(0);
  for (size_t i = 0; i < n; ++i) {
    scale[i] = one / hn::Sqrt(one + load(group.nuggets[i], lane));
    Lanes own = one;
    y[i] = scale[i];
    z[i] = scale[i] * matern52(squaredDistance(group.places[i], group.asked, lane));
    for (size_t j = 0; j < i; ++j) {
      Lanes sum = scale[i] * scale[j] * matern52(squaredDistance(group.places[i], group.places[j], lane));
      for (size_t k = 0; k < j; ++k) sum = sum - factor[i][k] * factor[j][k];
      factor[i][j] = sum * factor[j][j];
      own = own - factor[i][j] * factor[i][j];
      y[i] = y[i] - factor[i][j] * y[j];
      z[i] = z[i] - factor[i][j] * z[j];
    }
    factor[i][i] = one / hn::Sqrt(hn::Max(own, number(kLeast)));
    y[i] = y[i] * factor[i][i];
    z[i] = z[i] * factor[i][i];
    yy = yy + y[i] * y[i];
    yz = yz + y[i] * z[i];
  }
  const Lanes mu = isSimple ? number(0) : (one - yz) / yy;
  Lanes w[kMaxBlended];
  for (size_t i = n; i-- > 0;) {
    Lanes sum = z[i] + mu * y[i];
    for (size_t k = i + 1; k < n; ++k) sum = sum - factor[k][i] * w[k];
    w[i] = sum * factor[i][i];
  }
  for (size_t i = 0; i < n; ++i) hn::Store(w[i] * scale[i], kTag, group.weights[i].data() + lane);
}

void solveGroup(KrigingBatch::Group& group, bool isSimple) {
  for (size_t lane = 0; lane < KrigingBatch::kLanes; lane += kWidth) solveLanes(group, lane, isSimple);
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::weights
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::weights {

HWY_EXPORT(solveGroup);

KrigingScales scalesFor(float halfScale, float reached) {
  constexpr KrigingScales shadow{.half = 0.8f, .light = 1, .view = 1};
  const KrigingScales lit{.half = halfScale};
  const auto between = [&](float ofShadow, float ofLight) { // 1 / scale^2 is linear in the state
    return 1 / std::sqrt((1 - reached) / (ofShadow * ofShadow) + reached / (ofLight * ofLight));
  };
  return {between(shadow.half, lit.half), between(shadow.light, lit.light), between(shadow.view, lit.view),
          lit.shadow};
}

size_t KrigingBatch::ask(const PairPlace& asked) {
  const size_t lane = count_ % kLanes;
  if (count_ / kLanes == groups_.size()) groups_.emplace_back();
  Group& group = groups_[count_ / kLanes];
  if (lane == 0) {
    group.most = 0;
    group.count.fill(0);
    for (Lanes<float>& nuggets : group.nuggets) nuggets.fill(kInfinity);
  }
  for (size_t i = 0; i < asked.size(); ++i) group.asked[i][lane] = asked[i];
  return count_++;
}

void KrigingBatch::add(const KrigingSample& sample) {
  assert(count_ > 0);
  const size_t lane = (count_ - 1) % kLanes;
  Group& group = groups_[(count_ - 1) / kLanes];
  const size_t number = group.count[lane]++;
  assert(number < kMaxBlended);
  group.most = std::max(group.most, group.count[lane]);
  for (size_t i = 0; i < sample.place.size(); ++i) group.places[number][i][lane] = sample.place[i];
  group.nuggets[number][lane] = sample.nugget;
  group.indices[number][lane] = sample.index;
}

void KrigingBatch::solve() {
  for (size_t i = 0; i * kLanes < count_; ++i) HWY_DYNAMIC_DISPATCH(solveGroup)(groups_[i], false);
}
void KrigingBatch::solveSimple() {
  for (size_t i = 0; i * kLanes < count_; ++i) HWY_DYNAMIC_DISPATCH(solveGroup)(groups_[i], true);
}

BlendSet KrigingBatch::weights(size_t request) const {
  const Group& group = groups_[request / kLanes];
  const size_t lane = request % kLanes;
  BlendSet weights;
  for (size_t i = 0; i < group.count[lane]; ++i)
    weights.push({group.indices[i][lane], group.weights[i][lane]});
  return weights;
}

BlendSet KrigingBatch::positiveWeights(size_t request) const {
  float sum = 0;
  BlendSet positive;
  for (const Blended& sample : weights(request))
    if (sample.weight > 0) {
      sum += sample.weight;
      positive.push(sample);
    }
  for (Blended& sample : positive) sample.weight /= sum;
  return positive;
}

namespace {

KrigingBatch batchOf(std::span<const KrigingSample> samples, const PairPlace& asked) {
  KrigingBatch batch;
  batch.ask(asked);
  for (const KrigingSample& sample : samples) batch.add(sample);
  return batch;
}

} // namespace

BlendSet krigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked) {
  KrigingBatch batch = batchOf(samples, asked);
  batch.solve();
  return batch.positiveWeights(0);
}

BlendSet simpleKrigingWeights(std::span<const KrigingSample> samples, const PairPlace& asked) {
  KrigingBatch batch = batchOf(samples, asked);
  batch.solveSimple();
  return batch.weights(0);
}

namespace {

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
#endif
