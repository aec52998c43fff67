#include "render/surfels/patch_corners.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

namespace surflect::surfels {

namespace {

constexpr size_t kCorners = 4;
constexpr float kShadowEdge = 0.25f; // difference of shadow states

constexpr uint32_t kLeastLinear = 6; // surfels of a run

// A run of the list of visible surfels: those of one patch, or surfels that answer for themselves.
struct Run {
  uint32_t begin, end;
  bool isLinear = true;

  uint32_t size() const { return end - begin; }
  // The run itself, or groups of at most four surfels.
  uint32_t groups() const { return isLinear ? 1 : (size() + kCorners - 1) / kCorners; }
};

std::vector<Run> patchRuns(const Patches& patches, std::span<const uint32_t> visible) {
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

// Successive runs of surfels that answer for themselves are one run.
std::vector<Run> joined(const std::vector<Run>& runs) {
  std::vector<Run> all;
  for (const Run& run : runs)
    if (!all.empty() && !run.isLinear && !all.back().isLinear)
      all.back().end = run.end;
    else
      all.push_back(run);
  return all;
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

// Corners of a run and the weights of its surfels.
class Corners {
public:
  explicit Corners(std::span<const Vec3<double>> places) : places_(places) {
    Vec3<double> middle = Vec3<double>::Zero();
    for (const Vec3<double>& place : places) middle += place / static_cast<double>(places.size());
    corners_[0] = farthest([&](const Vec3<double>& x) { return (x - middle).squaredNorm(); });
    first_ = places[corners_[0]];
    corners_[1] = farthest([&](const Vec3<double>& x) { return (x - first_).squaredNorm(); });
    along_ = places[corners_[1]] - first_;
    corners_[2] = farthest([&](const Vec3<double>& x) { return across(x).squaredNorm(); });
    side_ = across(places[corners_[2]]);
    corners_[3] = farthest([&](const Vec3<double>& x) { return -side_.dot(x - first_); });
  }

  size_t operator[](size_t corner) const { return corners_[corner]; }

  weights::AtCorners<float> weightsOf(const Vec3<double>& place) const {
    const size_t third = side_.dot(place - first_) >= 0 ? 2 : 3;
    const Vec3<double> way = places_[corners_[third]] - first_, x = place - first_;
    const Vec2<double> at = coordinates(along_, way, x);
    weights::AtCorners<float> all{};
    all[0] = static_cast<float>(std::max(0.0, 1 - at[0] - at[1]));
    all[1] = static_cast<float>(std::max(0.0, at[0]));
    all[third] = static_cast<float>(std::max(0.0, at[1]));
    const float sum = all[0] + all[1] + all[third];
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

  // Component of the way from the first corner that is perpendicular to `along`.
  Vec3<double> across(const Vec3<double>& x) const {
    const double squared = std::max(along_.squaredNorm(), std::numeric_limits<double>::min());
    return x - first_ - along_.dot(x - first_) / squared * along_;
  }

  // (s, t) for which s u + t v comes nearest to x; t is 0 where u and v are parallel.
  static Vec2<double> coordinates(const Vec3<double>& u, const Vec3<double>& v, const Vec3<double>& x) {
    constexpr double kLeast = 1e-12, kTiny = std::numeric_limits<double>::min();
    const double uu = std::max(u.dot(u), kTiny), uv = u.dot(v), vv = v.dot(v);
    const double rest = vv - uv * uv / uu; // squared height of v over u
    const double t = rest > kLeast * uu ? (v.dot(x) - uv / uu * u.dot(x)) / rest : 0;
    return {(u.dot(x) - t * uv) / uu, t};
  }

  std::span<const Vec3<double>> places_;
  std::array<size_t, kCorners> corners_{};
  Vec3<double> first_, along_ = Vec3<double>::Zero(), side_; // place of the first corner, way to the second
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

std::vector<uint32_t> changedGroups(const PatchCorners& before, const PatchCorners& now) {
  const auto cornersOf = [](const PatchCorners& all, size_t group) {
    return std::span(all.corners).subspan(kCorners * group, kCorners);
  };
  std::vector<uint32_t> changed;
  size_t same = 0; // the first group of `before` that does not lie before that of `now`
  for (uint32_t group = 0; group < now.groups(); ++group) {
    while (same < before.groups() && before.firstPlace[same] < now.firstPlace[group]) ++same;
    if (same == before.groups() || before.firstPlace[same] != now.firstPlace[group] ||
        before.firstPlace[same + 1] != now.firstPlace[group + 1] ||
        !std::ranges::equal(cornersOf(before, same), cornersOf(now, group)))
      changed.push_back(group);
  }
  return changed;
}

PatchCorners someGroups(const PatchCorners& all, std::span<const uint32_t> groups,
                        std::vector<uint32_t>& places) {
  PatchCorners some;
  places.clear();
  for (const uint32_t group : groups) {
    const uint32_t begin = all.firstPlace[group], end = all.firstPlace[group + 1];
    const auto first = static_cast<uint32_t>(places.size());
    some.firstPlace.push_back(first);
    for (size_t k = 0; k < kCorners; ++k) {
      assert(all.corners[kCorners * group + k] >= begin && all.corners[kCorners * group + k] < end);
      some.corners.push_back(all.corners[kCorners * group + k] - begin + first);
    }
    for (uint32_t place = begin; place < end; ++place) {
      places.push_back(place);
      some.weights.push_back(all.weights[place]);
    }
  }
  some.firstPlace.push_back(static_cast<uint32_t>(places.size()));
  return some;
}

PatchCorners patchCorners(const SurfelCloud& cloud, const Patches& patches, std::span<const uint32_t> visible,
                          std::span<const float> reached, size_t lights) {
  assert(reached.empty() || reached.size() == visible.size() * lights);
  std::vector<Run> runs = patchRuns(patches, visible);
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t i) {
    runs[i].isLinear =
        runs[i].size() >= kLeastLinear && (reached.empty() || isEvenlyLit(runs[i], reached, lights));
  });
  runs = joined(runs);
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
