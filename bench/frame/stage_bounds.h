// Lower bounds of a frame's time, stage by stage: bytes that must be moved and arithmetic that must be done,
// however it is written, over what the machine can do. Caches between stages are taken to hold nothing, and a
// search looks at all candidates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace surflect::bench {

// Work of one frame.
struct FrameCounts {
  size_t surfels = 0, drawn = 0, visible = 0; // in the cloud; facing the viewer on the picture; with a weight
  size_t pixels = 0, contributions = 0;       // of the picture; pairs of pixel and surfel
  size_t views = 0, rigLights = 0;            // of the model
  size_t lights = 0;                          // of the shot, point or directional
  uint64_t pairs = 0;                         // of surfel and blended view
  uint64_t lookups = 0;                       // pairs x captured lights with weight
  uint64_t blocks = 0, blockBytes = 0;        // touched by the pairs; as stored
  double rank = 0;                            // mean of the blocks over pairs
};

struct StageWork {
  std::string_view stage;
  double bytes = 0, operations = 0; // floating-point operations of 32 bits; a multiply-add is two
};

// Stages in order, by their names in FrameStats.
inline constexpr std::string_view kStages[] = {"warp", "splat", "queries", "ulr", "look-up", "develop"};

// One entry for each of kStages, in order.
std::vector<StageWork> workOf(const FrameCounts& counts);

// The highest rates that all threads together have shown.
struct MachineLimits {
  int threads = 1;
  double bytesPerSecond = 0, flopsPerSecond = 0;
};

// The longer of bytes at the highest bandwidth and operations at the highest rate.
double boundSeconds(const StageWork& work, const MachineLimits& limits);
bool isBoundByMemory(const StageWork& work, const MachineLimits& limits);

} // namespace surflect::bench
