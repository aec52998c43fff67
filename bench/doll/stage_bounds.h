// What a frame cannot do without, stage by stage: bytes that must be moved, and arithmetic that must be done,
// however it is written. Over the machine's limits they give the time below which no program can get. Caches
// between stages are taken to hold nothing; what is looked for is looked for by looking at all.
// docs/performance.md derives the figures.
#pragma once

#include "bench/doll/machine.h"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace surflect::bench {

// Of one frame.
struct FrameCounts {
  size_t surfels = 0, drawn = 0,
         visible = 0;                   // of the cloud; facing the viewer and on the picture; with a weight
  size_t pixels = 0, contributions = 0; // of the picture; pairs of pixel and surfel
  size_t views = 0, rigLights = 0;      // of the model
  size_t lights = 0;                    // of the shot, each from one direction at a surfel
  size_t environments = 0, directions = 0; // of the shot; that stand for them all
  uint64_t pairs = 0;                      // of surfel and blended view
  uint64_t lookups = 0;                    // pairs x the captured lights that have weight
  uint64_t blocks = 0, blockBytes = 0;     // that the pairs touch; as stored
  double rank = 0;                         // of the blocks, mean over pairs
};

struct StageWork {
  std::string_view stage;
  double bytes = 0, operations = 0; // floating-point operations of 32 bits, a multiply-add is two
};

inline constexpr std::string_view kStages[] = {"warp",      "splat",   "queries", "camera ulr",
                                               "light ulr", "look-up", "develop"};

// One entry for each of kStages, in order.
std::vector<StageWork> workOf(const FrameCounts& counts);

// The longer of the two: bytes at the highest bandwidth, operations at the highest rate that all threads have
// shown.
double boundSeconds(const StageWork& work, const MachineLimits& limits);
bool isBoundByMemory(const StageWork& work, const MachineLimits& limits);

} // namespace surflect::bench
