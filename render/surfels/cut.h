// Cut: the surfels that a frame draws, at the level of detail of their size on the screen.
#pragma once

#include "render/scene/scene.h"
#include "srf/weights/query.h"
#include "surfel/cloud.h"
#include "surfel/level_of_detail.h"
#include "warp/warp.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::surfels {

// Surfels of one level of detail, patch by patch.
struct CutLevel {
  std::vector<uint32_t> first;   // per patch: its first entry; then the end
  std::vector<uint32_t> surfels; // per entry: its index in the whole cloud, ascending
  SurfelCloud cloud; // per entry; at level 0 without positions and frames: those of the whole cloud
  std::vector<float> nextRadius, nextCoverage; // per entry: splat at the next level; 0 without one
};

// Levels of detail of a cloud, and the patches that have one level each in a frame.
struct CutLevels {
  Patches patches;
  SurfelCloud middles; // of the patches
  std::vector<CutLevel> levels;
};
CutLevels cutLevels(const SurfelCloud& cloud, const LevelsOfDetail& detail, const Progress& progress = {});

// Level of detail at which neighbouring surfels are `wanted` pixels apart, if they are `size` pixels apart at
// level 0: 2 log2(wanted / size), as a level has half the surfels of the one before; at least 0.
double levelFor(double size, double wanted);

// Distance in pixels of surfels that are 1 apart at rest, around a warped surfel: root of the product of the
// largest and the smallest stretch from rest to screen. The smallest counts as no less than kLeastTilt of the
// largest, as outlines need surfels, too. 0 if the surfel is dead or not in front of the viewer; its patch is
// then drawn at level 0.
inline constexpr double kLeastTilt = 0.25;
double pixelsPerLength(const capture::Camera<ObjectSpace>& camera, const DeformedCloud& deformed,
                       size_t surfel);

// Share of the cloud up to which a cut is made: copying a larger one costs more time than it saves.
inline constexpr double kLargestCut = 0.9;

// The surfels that are drawn.
struct Cut {
  bool isWhole = false; // the whole cloud is drawn as it is; `cloud` and `surfels` have no meaning
  bool isNew = true;    // it may differ from the cut that cutFor was given
  SurfelCloud cloud;
  std::vector<uint32_t> surfels; // their indices in the whole cloud, ascending

  // Working memory of cutFor.
  DeformedCloud middles;
  std::vector<double> levels; // per patch; empty if the cut is unfinished
  std::vector<double> wanted; // levels of the next cut
  std::vector<size_t> first;  // per patch: its first surfel in `surfels`; then the end
};

// Surfels of a frame at `surfelSize` > 0 pixels from each other. Each patch has one level, that of its
// middle, with the splats of splatAt. Levels, and with them the splats, change continuously with warp and
// camera. There is one exception: a cut that would leave out less than a tenth of the cloud is not made
// (kLargestCut). `kept` donates its memory; a cut of the same cloud with the same levels is returned as it
// is.
Cut cutFor(const SurfelCloud& cloud, const CutLevels& levels, const warp::Warp& warp,
           const capture::Camera<ObjectSpace>& camera, double surfelSize, const Progress& progress = {},
           Cut kept = {});

// Queries for patches of surfels that share the weights of cameras and lights.

// Queries for the patches that have a visible surfel. Indices of surfels are those of the drawn cloud.
struct PatchQueries {
  std::vector<uint32_t> surfels;    // one per query: the patch's middle, or a visible surfel if that is dead
  std::vector<uint32_t> firstPlace; // of each query in the list of visible surfels, then its length
};

// visible: surfels of the drawn cloud, ascending. patches: of the drawn cloud.
PatchQueries patchQueries(const Patches& patches, std::span<const uint32_t> visible,
                          const DeformedCloud& deformed);

// Adds the places of the queries [begin, end) to a batch.
void addPlaces(const PatchQueries& queries, std::span<const uint32_t> visible, size_t begin, size_t end,
               weights::QueryBatch& batch);

// Patches of a cut: what the cut has left of each patch of the whole cloud. The middle of a patch is the
// middle surfel of its run.
Patches patchesIn(const Cut& cut, const Patches& whole);

} // namespace surflect::surfels
