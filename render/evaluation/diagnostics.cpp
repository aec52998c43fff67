#include "render/evaluation/diagnostics.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace surflect::evaluation {

Trust trustIn(const image::Image& color, const image::Image& predictedError, double white) {
  assert(color.channels == 4 && predictedError.channels == 1 &&
         color.values.size() == 4 * predictedError.values.size());
  Trust trust;
  for (size_t pixel = 0; pixel < predictedError.values.size(); ++pixel) {
    if (!(color.values[4 * pixel + 3] > 0.5f)) continue;
    ++trust.pixels;
    if (predictedError.values[pixel] <= kTrustedError * white) ++trust.trusted;
  }
  return trust;
}

namespace {

// Fraction of the finite points outside the reach of the warp's rest mesh; 0 if it has none.
double shareUnreached(const warp::WarpMotion& motion, const std::vector<Vec3<double>>& points) {
  const auto* mesh = std::get_if<warp::MeshMotion>(&motion);
  const auto* skeleton = std::get_if<warp::SkeletonMotion>(&motion);
  if (!mesh && !skeleton) return 0;
  size_t finite = 0, beyond = 0;
  for (const Vec3<double>& x : points) {
    if (!x.allFinite()) continue;
    ++finite;
    beyond += !(mesh ? mesh->sequence->reaches(x) : skeleton->rig->reaches(x));
  }
  return finite == 0 ? 0 : static_cast<double>(beyond) / static_cast<double>(finite);
}

} // namespace

std::optional<std::string> beyondRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                          std::span<const Point3<AcquisitionSpace>> object) {
  constexpr size_t most = 4000;
  constexpr double tolerated = 0.1;
  std::vector<Vec3<double>> points;
  for (size_t i = 0; i < object.size(); i += object.size() / most + 1)
    points.push_back(object[i].raw().cast<double>());

  // Each warp acts on the output of those before it; warps after the last mesh do not matter.
  const auto hasMesh = [](const warp::WarpMotion& motion) {
    return std::holds_alternative<warp::MeshMotion>(motion) ||
           std::holds_alternative<warp::SkeletonMotion>(motion);
  };
  size_t end = script.warps.size();
  while (end > 0 && !hasMesh(script.warps[end - 1])) --end;
  for (size_t i = 0; i < end; ++i) {
    if (const double share = shareUnreached(script.warps[i], points); share > tolerated)
      return fmt::format(
          "{}: warp[{}]: {:.0f} % of the surfels are further from its rest mesh than twice the "
          "length of its edges: are its units and axes those of the model?",
          script.path.string(), i, 100 * share);
    if (i + 1 == end) break;
    try {
      const warp::WarpPointer warp = warp::evaluateAt(script.warps[i], time);
      for (Vec3<double>& x : points) x = warp->position(x);
    } catch (Error& error) {
      throw std::move(error).at(fmt::format("warp[{}]", i)).in(script.path);
    }
  }
  return std::nullopt;
}

std::vector<double> ranksOf(std::span<const double> values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return values[i]; });
  std::vector<double> ranks(values.size());
  for (size_t first = 0, last = 0; first < order.size(); first = last) {
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (size_t i = first; i < last; ++i) ranks[order[i]] = static_cast<double>(first + last - 1) / 2;
  }
  return ranks;
}

std::optional<double> rankCorrelation(std::span<const double> a, std::span<const double> b) {
  assert(a.size() == b.size());
  const std::vector<double> ranksA = ranksOf(a), ranksB = ranksOf(b);
  const double mean = (static_cast<double>(a.size()) - 1) / 2;
  double aa = 0, bb = 0, ab = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double x = ranksA[i] - mean, y = ranksB[i] - mean;
    aa += x * x, bb += y * y, ab += x * y;
  }
  if (!(aa > 0 && bb > 0)) return std::nullopt;
  return ab / std::sqrt(aa * bb);
}

namespace {

// RMS of the parts that are left when those of the largest keys are taken away.
std::vector<double> curveBy(std::span<const double> keys, std::span<const double> error, size_t steps) {
  const size_t count = error.size();
  std::vector<size_t> order(count);
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return keys[i]; });
  std::vector<double> sums{0}; // of the squared errors of the first parts; equal keys have their mean
  for (size_t first = 0, last = 0; first < count; first = last) {
    double sum = 0;
    for (; last < count && keys[order[last]] == keys[order[first]]; ++last)
      sum += error[order[last]] * error[order[last]];
    const double mean = sum / static_cast<double>(last - first);
    for (size_t i = first; i < last; ++i) sums.push_back(sums.back() + mean);
  }
  std::vector<double> curve;
  for (size_t step = 0; step < steps && count > 0; ++step) {
    const size_t kept = std::max(size_t{1}, count - count * step / steps);
    curve.push_back(std::sqrt(sums[kept] / static_cast<double>(kept)));
  }
  return curve;
}

} // namespace

Sparsification sparsify(std::span<const double> error, std::span<const double> predicted, size_t steps) {
  assert(error.size() == predicted.size() && steps >= 1);
  return {curveBy(predicted, error, steps), curveBy(error, error, steps)};
}

double sparsificationError(const Sparsification& curves) {
  if (curves.best.empty() || !(curves.best[0] > 0)) return 0;
  double sum = 0;
  for (size_t step = 0; step < curves.best.size(); ++step)
    sum += curves.byPrediction[step] - curves.best[step];
  return sum / static_cast<double>(curves.best.size()) / curves.best[0];
}

} // namespace surflect::evaluation
