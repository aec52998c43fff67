#include "render/surfels/patch_corners.h"

#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

namespace surflect::surfels {

namespace {

constexpr size_t kCorners = 4;
constexpr float kShadowEdge = 0.25f; // difference of shadow states

// A run of the list of visible surfels that are in one patch.
struct Run {
  uint32_t begin, end;
  bool isLinear = false;

  uint32_t size() const { return end - begin; }
  // The run itself, or groups of at most four surfels.
  uint32_t groups() const { return isLinear ? 1 : (size() + kCorners - 1) / kCorners; }
};

std::vector<Run> runsOf(const Patches& patches, std::span<const uint32_t> visible) {
  std::vector<Run> runs;
  size_t next = 0; // patch after that of the last surfel
  for (uint32_t place = 0; place < visible.size(); ++place) {
    if (runs.empty() || visible[place] >= patches.first[next]) {
      while (patches.first[next] <= visible[place]) ++next;
      runs.push_back({place, place});
    }
    runs.back().end = place + 1;
  }
  return runs;
}

// Whether no light's shadow begins within a run.
bool isEvenlyLit(const Run& run, std::span<const float> reached, size_t lights) {
  for (size_t light = 0; light < lights; ++light) {
    float least = 1, most = 0;
    for (size_t place = run.begin; place < run.end; ++place) {
      const float state = reached[place * lights + light];
      least = std::min(least, state);
      most = std::max(most, state);
    }
    if (most - least > kShadowEdge) return false;
  }
  return true;
}

// Corners of a run and the weights b of its surfels.
class Corners {
public:
  explicit Corners(std::span<const Vec3<double>> places) : places_(places) {
    Vec3<double> middle = Vec3<double>::Zero();
    for (const Vec3<double>& place : places) middle += place;
    middle /= static_cast<double>(places.size());
    corners_[0] = farthest([&](const Vec3<double>& x) { return (x - middle).squaredNorm(); });
    const Vec3<double>& first = places[corners_[0]];
    corners_[1] = farthest([&](const Vec3<double>& x) { return (x - first).squaredNorm(); });
    const Vec3<double> along = (places[corners_[1]] - first).normalized();
    const auto across = [&](const Vec3<double>& x) {
      return Vec3<double>(x - first - along.dot(x - first) * along);
    };
    corners_[2] = farthest([&](const Vec3<double>& x) { return across(x).squaredNorm(); });
    const Vec3<double> side = across(places[corners_[2]]);
    corners_[3] = farthest([&](const Vec3<double>& x) { return -side.dot(x - first); });
    mean_ = Vec3<double>::Zero();
    for (const size_t corner : corners_) mean_ += places[corner] / kCorners;
    Mat3<double> covariance = Mat3<double>::Zero();
    for (const size_t corner : corners_)
      covariance += (places[corner] - mean_) * (places[corner] - mean_).transpose();
    constexpr double kRidge = 1e-3, kLeast = 1e-30;
    covariance += (kRidge * covariance.trace() + kLeast) * Mat3<double>::Identity();
    inverse_ = covariance.inverse();
  }

  size_t operator[](size_t corner) const { return corners_[corner]; }

  weights::AtCorners<float> weightsOf(const Vec3<double>& place) const {
    const Vec3<double> way = inverse_ * (place - mean_);
    weights::AtCorners<float> all;
    float sum = 0;
    for (size_t k = 0; k < kCorners; ++k) {
      all[k] = std::max(0.f, static_cast<float>(0.25 + (places_[corners_[k]] - mean_).dot(way)));
      sum += all[k];
    }
    for (float& weight : all) weight /= sum;
    return all;
  }

private:
  template <class Distance> size_t farthest(const Distance& distance) const {
    size_t best = 0;
    double most = distance(places_[0]);
    for (size_t i = 1; i < places_.size(); ++i)
      if (const double own = distance(places_[i]); own > most) {
        most = own;
        best = i;
      }
    return best;
  }

  std::span<const Vec3<double>> places_;
  std::array<size_t, kCorners> corners_;
  Vec3<double> mean_;
  Mat3<double> inverse_;
};

} // namespace

std::vector<uint32_t> PatchCorners::surfels(std::span<const uint32_t> visible) const {
  std::vector<uint32_t> all;
  all.reserve(corners.size());
  for (const uint32_t place : corners) all.push_back(visible[place]);
  return all;
}

void PatchCorners::addPlaces(std::span<const uint32_t> visible, size_t begin, size_t end,
                             weights::QueryBatch& batch) const {
  assert(begin % kCorners == 0 && end % kCorners == 0);
  const uint32_t first = firstPlace[begin / kCorners], last = firstPlace[end / kCorners];
  batch.places.assign(visible.begin() + first, visible.begin() + last);
  batch.cornerWeights.assign(weights.begin() + first, weights.begin() + last);
  batch.firstPlace.clear();
  for (size_t group = begin / kCorners; group <= end / kCorners; ++group)
    batch.firstPlace.push_back(firstPlace[group] - first);
}

PatchCorners patchCorners(const SurfelCloud& cloud, const Patches& patches, std::span<const uint32_t> visible,
                          std::span<const float> reached, size_t lights) {
  assert(reached.empty() || reached.size() == visible.size() * lights);
  std::vector<Run> runs = runsOf(patches, visible);
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t i) {
    runs[i].isLinear =
        runs[i].size() > kCorners && (reached.empty() || isEvenlyLit(runs[i], reached, lights));
  });
  std::vector<size_t> firstGroup{0};
  for (const Run& run : runs) firstGroup.push_back(firstGroup.back() + run.groups());

  PatchCorners result;
  result.corners.resize(kCorners * firstGroup.back());
  result.firstPlace.resize(firstGroup.back() + 1);
  result.firstPlace.back() = static_cast<uint32_t>(visible.size());
  result.weights.resize(visible.size());
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t i) {
    const Run& run = runs[i];
    if (run.isLinear) {
      std::vector<Vec3<double>> places;
      for (uint32_t place = run.begin; place < run.end; ++place)
        places.push_back(cloud.p0[visible[place]].raw().cast<double>());
      const Corners corners(places);
      result.firstPlace[firstGroup[i]] = run.begin;
      for (size_t k = 0; k < kCorners; ++k)
        result.corners[kCorners * firstGroup[i] + k] = run.begin + static_cast<uint32_t>(corners[k]);
      for (uint32_t place = run.begin; place < run.end; ++place)
        result.weights[place] = corners.weightsOf(places[place - run.begin]);
      return;
    }
    for (uint32_t group = 0; group < run.groups(); ++group) {
      const uint32_t begin = run.begin + group * kCorners;
      result.firstPlace[firstGroup[i] + group] = begin;
      for (uint32_t k = 0; k < kCorners; ++k) {
        const uint32_t place = std::min(begin + k, run.end - 1);
        result.corners[kCorners * (firstGroup[i] + group) + k] = place;
        if (begin + k < run.end) result.weights[place][k] = 1;
      }
    }
  });
  return result;
}

} // namespace surflect::surfels
