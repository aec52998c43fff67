// Level of detail: nested subsets of a cloud, each with splats that close the surface by themselves.
//
// Level 0 is the cloud. Each further level has about half the surfels of the one before, evenly spaced.
// Levels are continuous: at l + t, 0 <= t < 1, the picture is that of level l in parts 1 - t and of level l +
// 1 in parts t, with one splat for each surfel.
//
// [Yuksel 2015] Yuksel: Sample Elimination for Generating Poisson Disk Sample Sets, CGF 34(2).
#pragma once

#include "surfel/base/time.h"
#include "surfel/cloud.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect {

// Patches: small pieces of a cloud whose surfels have nearly the same directions to cameras and lights.

// Runs of neighbouring surfels of one sheet.
struct Patches {
  std::vector<uint32_t> first;  // first surfel of each patch, then the number of surfels
  std::vector<uint32_t> middle; // of each patch: the surfel nearest to the mean of its positions

  size_t size() const { return middle.size(); }
};

// Cuts a cloud that is sorted along a space-filling curve into runs of at most `most` > 0 surfels. A run also
// ends before a surfel that is too far from the run's first surfel, or whose normal differs from that
// surfel's by more than 45 degrees. Too far is beyond the width of a disc of `most` surfels, or 1/50 of the
// diagonal of the cloud's box. Cost: O(surfels).
Patches patchesOf(const SurfelCloud& cloud, size_t most);

struct DetailSplat {
  float radius, coverage; // as in SurfelCloud
  friend bool operator==(const DetailSplat&, const DetailSplat&) = default;
};

inline constexpr size_t kMostLevels = 10;

struct LevelsOfDetail {
  size_t count = 0; // of levels
  // Splats of surfel i at its levels 0, 1, .. are splats[first[i] .. first[i + 1]).
  std::vector<uint32_t> first; // one per surfel, then the end
  std::vector<DetailSplat> splats;

  std::span<const DetailSplat> of(size_t surfel) const {
    return std::span(splats).subspan(first[surfel], first[surfel + 1] - first[surfel]);
  }
  friend bool operator==(const LevelsOfDetail&, const LevelsOfDetail&) = default;
};

// Every second surfel: removes the most crowded surfel of a sheet until half are left, so that the remaining
// ones are evenly spaced [Yuksel 2015, §3]. Needs positions, frames and radii. Returns indices, ascending.
std::vector<uint32_t> everySecond(const SurfelCloud& cloud, const Progress& progress = {});

// The entries of a cloud at `indices`.
SurfelCloud subsetOf(const SurfelCloud& cloud, std::span<const uint32_t> indices);

// Builds levels as long as a level has more than 128 surfels, but at most kMostLevels. Splats are those of
// estimateSplats, except at level 0, which has the cloud's own. Throws Cancelled.
LevelsOfDetail levelsOfDetail(const SurfelCloud& cloud, const Progress& progress = {});

// The finest level with at most `most` surfels, or the coarsest one. `levels` has a level.
size_t finestLevel(const LevelsOfDetail& levels, size_t most);

// The splat of a surfel at level l + t, from its splats at its own levels; empty if it is in no level that
// takes part. It has the mass, coverage times squared radius, and the variance of the mixture of both
// levels' Gaussians:
//   c r^2 = (1 - t) c_l r_l^2 + t c_m r_m^2,   c r^4 = (1 - t) c_l r_l^4 + t c_m r_m^4,   m = l + 1;
// without terms of m if the surfel is not in level m: it then fades out in place.
std::optional<DetailSplat> splatAt(std::span<const DetailSplat> levels, size_t l, float t);

} // namespace surflect
