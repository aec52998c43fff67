#include "surfel/level_of_detail.h"

#include "surfel/geometry/neighbors.h"
#include "surfel/math/bounds.h"
#include "surfel/sampling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>

namespace surflect {

namespace {

constexpr float kLeastCosine = 0.7f; // between the normals of a patch and of its first surfel
constexpr float kWidest = 0.02f;     // of a patch, over the diagonal of the cloud's box

Vec3<float> normalOf(const SurfelCloud& cloud, size_t surfel) {
  return rotationOf<float>(cloud.r0[surfel]).col(2);
}

uint32_t middleOf(const SurfelCloud& cloud, size_t begin, size_t end) {
  Vec3<float> mean = Vec3<float>::Zero(); // relative to the first surfel
  for (size_t i = begin; i < end; ++i) mean += cloud.p0[i].raw() - cloud.p0[begin].raw();
  mean = cloud.p0[begin].raw() + mean / static_cast<float>(end - begin);
  size_t middle = begin;
  const auto squared = [&](size_t i) { return (cloud.p0[i].raw() - mean).squaredNorm(); };
  for (size_t i = begin; i < end; ++i)
    if (squared(i) < squared(middle)) middle = i;
  return static_cast<uint32_t>(middle);
}

} // namespace

Patches patchesOf(const SurfelCloud& cloud, size_t most) {
  assert(most > 0);
  const size_t count = cloud.size();
  const float width = 1.5f * std::sqrt(static_cast<float>(most)); // of a patch, in spacings of surfels
  const float widest = kWidest * static_cast<float>(boundsOf(cloud.p0).diagonal().norm());
  Patches patches;
  for (size_t begin = 0, end = 0; begin < count; begin = end) {
    const Vec3<float> normal = normalOf(cloud, begin);
    const float farthest = std::min(width * cloud.radius[begin], widest);
    for (end = begin + 1; end < std::min(count, begin + most); ++end)
      if ((cloud.p0[end].raw() - cloud.p0[begin].raw()).norm() > farthest ||
          normal.dot(normalOf(cloud, end)) < kLeastCosine)
        break;
    patches.first.push_back(static_cast<uint32_t>(begin));
    patches.middle.push_back(middleOf(cloud, begin, end));
  }
  patches.first.push_back(static_cast<uint32_t>(count));
  return patches;
}

namespace {

constexpr size_t kFewest = 64; // surfels of a level
constexpr size_t kNeighbors = 12;
constexpr float kSameSheet = 0; // least cosine between the normals of surfels that crowd each other

// Crowding of a surfel by a neighbour at a distance, in units of their spacing. Half of the surfels of a
// hexagonal grid can keep sqrt 2 spacings between them, at which crowding ends. [Yuksel 2015, §3.2]
float crowding(float distance) {
  const float x = std::max(0.f, 1 - distance / std::numbers::sqrt2_v<float>);
  const float x2 = x * x, x4 = x2 * x2;
  return x4 * x4;
}

// The neighbours that crowd a surfel.
struct Crowd {
  struct Link {
    uint32_t j;
    float weight;
  };
  std::array<Link, kNeighbors> links;
  size_t count = 0;

  std::span<const Link> all() const { return std::span(links).first(count); }
  float sum(std::span<const uint8_t> removed) const {
    float sum = 0;
    for (const auto& [j, weight] : all()) sum += removed[j] ? 0 : weight;
    return sum;
  }
};

std::vector<Crowd> crowdsOf(const SurfelCloud& cloud, const Progress& progress) {
  const size_t n = cloud.size();
  const NeighborIndex index(cloud.p0, progress);
  std::vector<Vec3<float>> normals(n);
  for (size_t i = 0; i < n; ++i) normals[i] = rotationOf<float>(cloud.r0[i]).col(2);
  std::vector<Crowd> crowds(n);
  tbb::parallel_for(size_t{0}, n, [&](size_t i) {
    progress.checkNowAndThen(i);
    Crowd& crowd = crowds[i];
    for (const auto& [j, distance] : index.nearest(cloud.p0[i], kNeighbors + 1)) {
      const float spacing = (cloud.radius[i] + cloud.radius[j]) / 2;
      if (j == i || crowd.count == kNeighbors || !(normals[i].dot(normals[j]) > kSameSheet) || !(spacing > 0))
        continue;
      if (const float weight = crowding(distance / spacing); weight > 0)
        crowd.links[crowd.count++] = {j, weight};
    }
  });
  return crowds;
}

} // namespace

SurfelCloud subsetOf(const SurfelCloud& cloud, std::span<const uint32_t> indices) {
  SurfelCloud subset;
  const auto take = [&](const auto& from, auto& to) {
    to.reserve(indices.size());
    for (const uint32_t i : indices) to.push_back(from[i]);
  };
  take(cloud.p0, subset.p0);
  take(cloud.r0, subset.r0);
  take(cloud.radius, subset.radius);
  take(cloud.coverage, subset.coverage);
  return subset;
}

std::vector<uint32_t> everySecond(const SurfelCloud& cloud, const Progress& progress) {
  const size_t n = cloud.size();
  const std::vector<Crowd> crowds = crowdsOf(cloud, progress);
  struct Entry {
    float crowding;
    uint32_t surfel;
    bool operator<(const Entry& other) const {
      return crowding != other.crowding ? crowding < other.crowding : surfel > other.surfel;
    }
  };
  // Crowding only decreases, so an entry is an upper bound until it is computed again.
  std::vector<uint8_t> removed(n);
  std::vector<Entry> heap(n);
  for (uint32_t i = 0; i < n; ++i) heap[i] = {crowds[i].sum(removed), i};
  std::make_heap(heap.begin(), heap.end());
  for (size_t left = n; left > (n + 1) / 2;) {
    std::pop_heap(heap.begin(), heap.end());
    const auto [bound, i] = heap.back();
    if (!(bound > 0)) break; // no surfel has neighbours any more
    if (const float value = crowds[i].sum(removed); value < bound) {
      heap.back().crowding = value;
      std::push_heap(heap.begin(), heap.end());
      continue;
    }
    heap.pop_back();
    progress.checkNowAndThen(left);
    removed[i] = 1;
    --left;
  }
  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < n; ++i)
    if (!removed[i]) kept.push_back(i);
  return kept;
}

LevelsOfDetail levelsOfDetail(const SurfelCloud& cloud, const Progress& progress) {
  std::vector<std::vector<DetailSplat>> splats(cloud.size()); // per surfel, by level
  std::vector<uint32_t> members(cloud.size());                // surfels of the level, ascending
  std::iota(members.begin(), members.end(), 0u);
  SurfelCloud level = cloud;
  LevelsOfDetail result;
  for (;;) {
    for (size_t i = 0; i < members.size(); ++i)
      splats[members[i]].push_back({level.radius[i], level.coverage[i]});
    ++result.count;
    if (result.count >= kMostLevels || members.size() <= 2 * kFewest) break;
    const std::vector<uint32_t> half = everySecond(level, progress);
    if (half.size() == members.size()) break;
    level = subsetOf(level, half);
    estimateSplats(level, progress);
    for (size_t i = 0; i < half.size(); ++i) members[i] = members[half[i]];
    members.resize(half.size());
  }
  result.first.push_back(0);
  for (const std::vector<DetailSplat>& ofSurfel : splats) {
    result.splats.insert(result.splats.end(), ofSurfel.begin(), ofSurfel.end());
    result.first.push_back(static_cast<uint32_t>(result.splats.size()));
  }
  return result;
}

size_t finestLevel(const LevelsOfDetail& levels, size_t most) {
  std::array<size_t, kMostLevels> sizes{};
  for (size_t i = 0; i + 1 < levels.first.size(); ++i)
    for (size_t level = 0; level < levels.of(i).size(); ++level) ++sizes[level];
  size_t level = 0;
  while (level + 1 < levels.count && sizes[level] > most) ++level;
  return level;
}

std::optional<DetailSplat> splatAt(std::span<const DetailSplat> levels, size_t l, float t) {
  if (l >= levels.size()) return std::nullopt;
  if (t == 0) return levels[l];
  const auto [r, c] = levels[l];
  if (l + 1 >= levels.size()) return DetailSplat{r, (1 - t) * c};
  const auto [R, C] = levels[l + 1];
  const float mass = (1 - t) * c * r * r + t * C * R * R;
  const float squared = ((1 - t) * c * r * r * r * r + t * C * R * R * R * R) / mass;
  return DetailSplat{std::sqrt(squared), mass / squared};
}

} // namespace surflect
