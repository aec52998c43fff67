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

// The field of a warp's rest mesh, if it has one.
const warp::MeshField* restMeshOf(const warp::WarpMotion& motion) {
  if (const auto* mesh = std::get_if<warp::MeshMotion>(&motion)) return &mesh->sequence->field();
  if (const auto* skeleton = std::get_if<warp::SkeletonMotion>(&motion)) return &skeleton->rig->field();
  return nullptr;
}

// Fraction of points outside the reach of the rest mesh.
double shareUnreached(const warp::MeshField& rest, const std::vector<Vec3<double>>& points) {
  const auto beyond = std::ranges::count_if(points, [&](const Vec3<double>& x) { return !rest.reaches(x); });
  return static_cast<double>(beyond) / static_cast<double>(points.size());
}

// Mean distance between the sides of two boxes, over the diagonal of the second.
double boxDifference(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return ((a.min() - b.min()).cwiseAbs().sum() + (a.max() - b.max()).cwiseAbs().sum()) / 6 /
         b.diagonal().norm();
}

// Turns about x, of 90 (y up to z up) or -90 degrees, that bring the rest mesh around the points; none if it
// lies there already, both if its box cannot tell them apart.
std::vector<int> turnsOf(const warp::MeshField& rest, const std::vector<Vec3<double>>& points) {
  constexpr double kDiffers = 0.1, kAgrees = 1 / 3.; // of the object's diagonal; of the difference as it is
  Eigen::AlignedBox3d object;
  for (const Vec3<double>& x : points) object.extend(x);
  const Eigen::AlignedBox3d box = rest.restBox();
  const double asItIs = boxDifference(box, object);
  std::vector<int> turns;
  if (!(asItIs > kDiffers)) return turns;
  for (const int sign : {1, -1}) {
    const auto turned = [&](const Vec3<double>& x) -> Vec3<double> {
      return {x[0], -sign * x[2], sign * x[1]};
    };
    const Vec3<double> a = turned(box.min()), b = turned(box.max());
    if (boxDifference({a.cwiseMin(b), a.cwiseMax(b)}, object) < kAgrees * asItIs) turns.push_back(90 * sign);
  }
  return turns;
}

// Advice for a rest mesh that fits only after one of these turns about x, degrees.
std::string turningOf(const std::vector<int>& turns) {
  const std::string text = "its rest mesh fits the model only if it is turned by ";
  if (turns.size() == 2)
    return text +
           "90 or -90 degrees about x (y up against z up): export it so, or put a rigid warp with axis = "
           "[1, 0, 0] and angle_deg = -90 (or 90) before it, and one with the opposite angle after it";
  return text +
         fmt::format(
             "{} degrees about x, from {}: export it so, or put a rigid warp with axis = [1, 0, 0] and "
             "angle_deg = {} before it, and one with {} after it",
             turns[0], turns[0] > 0 ? "y up to z up" : "z up to y up", -turns[0], turns[0]);
}

} // namespace

std::optional<std::string> misplacedRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                             std::span<const Point3<AcquisitionSpace>> object) {
  constexpr size_t most = 4000;
  constexpr double tolerated = 0.1;
  std::vector<Vec3<double>> points;
  for (size_t i = 0; i < object.size(); i += object.size() / most + 1)
    points.push_back(object[i].raw().cast<double>());

  // Each warp acts on the output of those before it; warps after the last mesh do not matter.
  size_t end = script.warps.size();
  while (end > 0 && !restMeshOf(script.warps[end - 1])) --end;
  for (size_t i = 0; i < end; ++i) {
    std::erase_if(points, [](const Vec3<double>& x) { return !x.allFinite(); });
    const warp::MeshField* rest = points.empty() ? nullptr : restMeshOf(script.warps[i]);
    const auto at = fmt::format("{}: warp[{}]: ", script.path.string(), i);
    if (const auto turns = rest ? turnsOf(*rest, points) : std::vector<int>(); !turns.empty())
      return at + turningOf(turns);
    if (const double share = rest ? shareUnreached(*rest, points) : 0; share > tolerated)
      return at + fmt::format("{:.0f} % of the surfels are further from its rest mesh than twice the "
                              "length of its edges: are its units and axes those of the model?",
                              100 * share);
    const auto* mesh = std::get_if<warp::MeshMotion>(&script.warps[i]);
    if (mesh && mesh->sequence->displacement())
      return at + fmt::format("its cache begins with the rest mesh {}: if the object should not be there, "
                              "export it in world space",
                              *mesh->sequence->displacement());
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
