#include "tests/stability/entry.h"

#include "srf/capture/camera.h"
#include "srf/weights/kriging.h"
#include "srf/weights/light_blend.h"
#include "srf/weights/ulr.h"
#include "tests/srf/weights/lights.h"
#include "tests/support/random.h"

#include <Eigen/Dense>

#include <algorithm>

namespace surflect::stability {
namespace {

using weights::lights::Direction;
using weights::lights::directionOf;

// Weights as the papers print them: r = (1 - p / p_k+1) / p for the k least penalties, over their sum;
// without a (k+1)-th candidate, the last one stands for it.
std::vector<float> printedWeights(const std::vector<float>& penalties, size_t k) {
  std::vector<size_t> order(penalties.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return penalties[a] < penalties[b]; });
  std::vector<float> weights(penalties.size(), 0);
  if (order.empty()) return weights;
  const float threshold = penalties[order[std::min(k, order.size() - 1)]];
  float sum = 0;
  for (size_t i = 0; i < std::min(k, order.size()); ++i)
    sum += weights[order[i]] = (1 - penalties[order[i]] / threshold) / penalties[order[i]];
  for (float& weight : weights) weight /= sum;
  return weights;
}
std::vector<float> ourWeights(const std::vector<float>& penalties, size_t k) {
  weights::NearestCandidates nearest(k);
  for (uint32_t i = 0; i < penalties.size(); ++i) nearest.offer({i, penalties[i]});
  std::vector<float> weights(penalties.size(), 0);
  for (const auto& [index, weight] : weights::ulrWeights(nearest)) weights[index] = weight;
  return weights;
}

double sumError(const std::vector<float>& weights) {
  double sum = 0;
  for (const float weight : weights) sum += double{weight};
  return std::abs(sum - 1);
}

Measured sumErrors(const std::vector<float>& penalties, size_t k) {
  return {sumError(printedWeights(penalties, k)), sumError(ourWeights(penalties, k))};
}

// Largest difference of weights from the wanted ones.
Measured errors(const std::vector<float>& penalties, size_t k, const std::vector<float>& wanted) {
  const auto error = [&](const std::vector<float>& weights) {
    double largest = 0;
    for (size_t i = 0; i < weights.size(); ++i)
      raise(largest, std::abs(double{weights[i]} - double{wanted[i]}));
    return largest;
  };
  return {error(printedWeights(penalties, k)), error(ourWeights(penalties, k))};
}

float penaltyOf(const Vec3<double>& place, const Vec3<double>& camera, const Vec3<double>& towards) {
  const capture::Viewpoint<AcquisitionSpace> view(camera, false);
  return static_cast<float>(
      weights::anglePenalty(view.towards(assume<Point3<AcquisitionSpace, double>>(place)),
                            assume<Direction3<AcquisitionSpace, double>>(towards)));
}

// Largest change of a weight in a step of 1e-4 rad along a path past eight cameras.
Measured jumpAlongPath(size_t k, bool onlyNearest) {
  std::vector<Direction> cameras = weights::lights::spiral(24, 0);
  Measured jump;
  std::vector<float> lastNaive, lastOurs;
  for (int step = 0; step < 10000; ++step) {
    const double turn = 1e-4 * step;
    const Direction towards = directionOf({std::sin(turn), 0.1, std::cos(turn)});
    std::vector<float> penalties;
    for (const Direction& camera : cameras) penalties.push_back(weights::anglePenalty(camera, towards));
    // Naive: inverse distances of the k nearest, without a threshold.
    std::vector<float> naive(penalties.size(), 0);
    std::vector<float> sorted = penalties;
    std::ranges::sort(sorted);
    float sum = 0;
    for (size_t i = 0; i < penalties.size(); ++i)
      if (penalties[i] <= sorted[(onlyNearest ? 1 : k) - 1])
        sum += naive[i] = 1 / std::max(penalties[i], 1e-12f);
    for (float& weight : naive) weight /= sum;
    const std::vector<float> ours = ourWeights(penalties, k);
    for (size_t i = 0; i < penalties.size() && step > 0; ++i) {
      raise(jump.naive, std::abs(double{naive[i]} - double{lastNaive[i]}));
      raise(jump.ours, std::abs(double{ours[i]} - double{lastOurs[i]}));
    }
    lastNaive = naive, lastOurs = ours;
  }
  return jump;
}

} // namespace

Group ulrGroup() {
  constexpr float far = 0.05f;
  const float none = std::numeric_limits<float>::infinity();
  return {"Unstructured lumigraph weights",
          "r = (1 - p / p_k+1) / p over its sum, as printed",
          {
              {"query through a camera's centre", "the other cameras answer", "sum of weights - 1", 1e-6,
               [] {
                 const Vec3<double> p(1, 2, 3), towards(0, 0, 1);
                 std::vector<float> penalties{penaltyOf(p, p, towards)};
                 for (int i = 0; i < 5; ++i)
                   penalties.push_back(penaltyOf(p, p + Vec3<double>(0.3 * i - 0.5, 0.2, 2), towards));
                 return sumErrors(penalties, 3);
               }},
              {"two cameras in one place, both met", "each has half", "error of weights", 1e-6,
               [] {
                 return errors({0, 0, 0.1f, 0.2f, 0.3f}, 3, {0.5f, 0.5f, 0, 0, 0});
               }},
              {"all cameras more than 90 degrees away", "the nearest answer", "sum of weights - 1", 1e-6,
               [] {
                 return sumErrors({1.2f, 1.4f, 1.5f}, 3);
               }},
              {"no camera may answer", "no weights, so that fallback views answer",
               "number of weights that are not 0", 0,
               [=] {
                 const std::vector<float> penalties(4, none);
                 const auto count = [](const std::vector<float>& weights) {
                   return static_cast<double>(std::ranges::count_if(weights, [](float w) { return w != 0; }));
                 };
                 return Measured{count(printedWeights(penalties, 3)), count(ourWeights(penalties, 3))};
               }},
              {"one camera, k = 3", "it answers", "sum of weights - 1", 1e-6,
               [] { return sumErrors({0.2f}, 3); }},
              {"two cameras, k = 3, the second at 85 degrees", "the nearer has most", "its weight - 1", 0.02,
               [] {
                 return errors({0.1f, 0.92f}, 3, {1, 0});
               }},
              {"all penalties equal", "equal shares", "error of weights", 1e-6,
               [=] {
                 return errors(std::vector<float>(6, far), 3, {1 / 3.f, 1 / 3.f, 1 / 3.f, 0, 0, 0});
               }},
              {"k = 1 and a tie", "one answers", "sum of weights - 1", 1e-6,
               [=] {
                 return sumErrors({far, far}, 1);
               }},
              {"ties at rank k, along a path of 57 degrees", "weights change by as little as the path",
               "largest change in a step of 1e-4 rad", 1.2e-3, [] { return jumpAlongPath(3, false); },
               "inverse penalties without a threshold"},
              {"a penalty that is not a number", "it is left out", "sum of weights - 1", 1e-6,
               [] {
                 return sumErrors({0.2f, kNoAnswer, 0.3f, 0.5f, 0.9f}, 3);
               }},
          }};
}

namespace {

// w = C^-1 c in single precision without nugget, scaled to a sum of 1.
std::vector<double> plainKriging(const std::vector<weights::KrigingSample>& samples,
                                 const weights::PairPlace& asked) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXf c(n, n);
  Eigen::VectorXf right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      c(i, j) = weights::matern52(weights::squaredDistance(samples[i].place, samples[j].place));
    right[i] = weights::matern52(weights::squaredDistance(samples[i].place, asked));
  }
  const Eigen::VectorXf ones = Eigen::VectorXf::Ones(n);
  const Eigen::PartialPivLU<Eigen::MatrixXf> lu(c);
  const Eigen::VectorXf a = lu.solve(right), b = lu.solve(ones);
  const Eigen::VectorXf w = a + (1 - a.sum()) / b.sum() * b;
  return {w.data(), w.data() + n};
}

Measured largestWeight(const std::vector<weights::KrigingSample>& samples, const weights::PairPlace& asked) {
  Measured result;
  for (const double w : plainKriging(samples, asked)) raise(result.naive, std::abs(w));
  for (const auto& [index, weight] : weights::krigingWeights(samples, asked))
    raise(result.ours, std::abs(double{weight}));
  return result;
}

weights::PairPlace placeAt(const Vec3<double>& light, const Vec3<double>& view) {
  return weights::pairPlace(directionOf(light), directionOf(view), 1, {});
}
weights::KrigingSample sampleAt(uint32_t index, const Vec3<double>& light, const Vec3<double>& view) {
  return {index, placeAt(light, view), weights::nuggetOf(0.1f, 1)};
}

} // namespace

Group krigingGroup() {
  return {
      "Kriging weights",
      "C w = c in single precision, without the photographs' own variance",
      {
          {"a photograph twice", "weights of at most 1", "largest weight", 0.9,
           [] {
             const Vec3<double> light(0.2, 0.1, 1), view(-0.3, 0.2, 1);
             return largestWeight(
                 {sampleAt(0, light, view), sampleAt(1, light, view), sampleAt(2, {1, 0, 1}, view)},
                 placeAt({0.3, 0.1, 1}, view));
           }},
          {"photographs 1e-4 rad apart, nearly singular covariance", "weights of at most 1", "largest weight",
           0.4,
           [] {
             std::vector<weights::KrigingSample> samples;
             for (uint32_t i = 0; i < 6; ++i)
               samples.push_back(sampleAt(i, {1e-4 * i, 1e-4 * (i * i % 5), 1}, {0.3, 0, 1}));
             return largestWeight(samples, placeAt({0.02, 0, 1}, {0.3, 0, 1}));
           }},
          {"two equal photographs that disagree", "each has half: their mean is shown",
           "difference of their weights", 3e-5,
           [] {
             const std::vector<weights::KrigingSample> samples{sampleAt(0, {0, 0, 1}, {0.3, 0, 1}),
                                                               sampleAt(1, {0, 0, 1}, {0.3, 0, 1})};
             const auto asked = placeAt({0.1, 0, 1}, {0.3, 0, 1});
             const auto naive = plainKriging(samples, asked);
             const weights::BlendSet ours = weights::krigingWeights(samples, asked);
             return Measured{std::abs(naive[0] - naive[1]),
                             std::abs(double{ours[0].weight} - double{ours[1].weight})};
           }},
          {"light and viewer opposite: no half vector", "a finite place", "largest coordinate", 5,
           [] {
             const Vec3<float> light(0, 0, 1), view(0, 0, -1);
             const double naive = double{((light + view) / (light + view).norm()).norm()};
             double ours = 0;
             for (const float x : placeAt({0, 0, 1}, {0, 0, -1})) raise(ours, std::abs(double{x}));
             return Measured{naive, ours};
           },
           "(l + v) / |l + v|"},
          {"16 random photographs, against double precision", "the same weights", "largest difference", 2e-6,
           [] {
             std::mt19937 random(7);
             Measured result;
             for (int trial = 0; trial < 300; ++trial) {
               std::vector<weights::KrigingSample> samples;
               for (uint32_t i = 0; i < 16; ++i)
                 samples.push_back(
                     sampleAt(i, randomUnit(random) + Vec3<double>(0, 0, 2), randomUnit(random)));
               const auto asked = placeAt(randomUnit(random) + Vec3<double>(0, 0, 2), randomUnit(random));
               const std::vector<double> truth = weights::krigingWeightsReference(samples, asked);
               const std::vector<double> naive = plainKriging(samples, asked);
               std::vector<double> ours(16, 0);
               for (const auto& [index, weight] : weights::krigingWeights(samples, asked))
                 ours[index] = double{weight};
               for (size_t i = 0; i < 16; ++i) {
                 raise(result.naive, std::abs(naive[i] - truth[i]));
                 raise(result.ours, std::abs(ours[i] - truth[i]));
               }
             }
             return result;
           }},
      }};
}

namespace {

// Weights of a plane fitted to lights by moving least squares, without a ridge.
double plainPlaneWeight(const std::vector<Direction>& lights, const Direction& towards) {
  const Eigen::Vector3f l = towards.raw();
  const Eigen::Vector3f e1 = l.unitOrthogonal(), e2 = l.cross(e1);
  Eigen::MatrixXf a(static_cast<Eigen::Index>(lights.size()), 3);
  Eigen::VectorXf w(a.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const Eigen::Vector3f d = lights[i].raw();
    a.row(i) << 1, d.dot(e1), d.dot(e2);
    w[i] = 1 / std::max(weights::anglePenalty(lights[i], towards), 1e-12f);
  }
  const Eigen::Matrix3f normal = a.transpose() * w.asDiagonal() * a;
  const Eigen::VectorXf weights = w.asDiagonal() * a * normal.inverse() * Eigen::Vector3f::UnitX();
  return weights.allFinite() ? double{weights.cwiseAbs().maxCoeff()} : kNoAnswer;
}

double ourPlaneWeight(const std::vector<Direction>& lights, const Direction& towards) {
  double largest = 0;
  for (const float weight : weights::lights::weightsOf(lights, towards, {8, weights::LightFit::plane, false},
                                                       weights::lights::coverageOf(lights)))
    raise(largest, std::abs(double{weight}));
  return largest;
}

} // namespace

Group lightGroup() {
  return {"Blends of captured lights",
          "moving least squares in single precision, without a ridge",
          {
              {"lights on a line, the query beside it", "weights of at most 1", "largest weight", 0.75,
               [] {
                 std::vector<Direction> lights;
                 for (int i = -3; i <= 3; ++i) lights.push_back(directionOf({0.1 * i, 0, 1}));
                 const Direction towards = directionOf({0.02, 0.1, 1});
                 return Measured{plainPlaneWeight(lights, towards), ourPlaneWeight(lights, towards)};
               }},
              {"lights 1e-4 from a line", "weights of at most 1", "largest weight", 0.75,
               [] {
                 std::vector<Direction> lights;
                 for (int i = -3; i <= 3; ++i)
                   lights.push_back(directionOf({0.1 * i, 1e-4 * (i * i % 3), 1}));
                 const Direction towards = directionOf({0.02, 0.1, 1});
                 return Measured{plainPlaneWeight(lights, towards), ourPlaneWeight(lights, towards)};
               }},
              {"a single captured light, 27 degrees away", "it answers, with its vector irradiance",
               "weight times cosine - 1", 1e-6,
               [] {
                 const std::vector<Direction> lights{directionOf({0, 0, 1})};
                 const Direction towards = directionOf({0.5, 0.1, 1});
                 const double cosine = double{towards.raw().dot(lights[0].raw())};
                 return Measured{std::abs(plainPlaneWeight(lights, towards) * cosine - 1),
                                 std::abs(ourPlaneWeight(lights, towards) * cosine - 1)};
               }},
              {"two lights in one place, both met", "each has half", "largest weight - 1/2", 1e-6,
               [] {
                 const std::vector<Direction> lights{directionOf({0, 0, 1}), directionOf({0, 0, 1}),
                                                     directionOf({1, 0, 1}), directionOf({0, 1, 1})};
                 const Direction towards = directionOf({0, 0, 1});
                 return Measured{std::abs(plainPlaneWeight(lights, towards) - 0.5),
                                 std::abs(ourPlaneWeight(lights, towards) - 0.5)};
               }},
          }};
}

} // namespace surflect::stability
