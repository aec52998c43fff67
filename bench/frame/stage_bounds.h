// Lower bounds of a frame's time by stages: the bytes that any implementation must move and the arithmetic
// that it must do, divided by the machine's limits. Caches are assumed empty between stages, and searches to
// examine all candidates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace surflect::bench {

// Work of one frame.
struct FrameCounts {
  size_t surfels = 0, drawn = 0, visible = 0; // in the cloud; front-facing on the picture; with a weight
  size_t pixels = 0, contributions = 0;       // picture size; (pixel, surfel) pairs
  size_t views = 0, rigLights = 0;            // counts of the model
  size_t lights = 0;                          // point and directional lights of the shot
  uint64_t pairs = 0;                         // (surfel, blended view) pairs
  uint64_t lookups = 0;                       // pairs times captured lights with weight
  uint64_t blocks = 0, blockBytes = 0;        // blocks touched by the pairs; their stored size
  double rank = 0;                            // mean rank of the blocks, over pairs
};

struct StageWork {
  std::string_view stage;
  double bytes = 0, operations = 0; // 32-bit floating-point operations; a multiply-add is two
};

// Names of the stages, in order, as in FrameStats.
inline constexpr std::string_view kStages[] = {"warp", "splat", "queries", "ulr", "look-up", "develop"};

// Work of each of kStages, in order.
std::vector<StageWork> workOf(const FrameCounts& counts);

// Highest rates measured with all threads together.
struct MachineLimits {
  int threads = 1;
  double bytesPerSecond = 0, flopsPerSecond = 0;
};

// Time for the bytes at full bandwidth or for the operations at full rate, whichever is longer.
double boundSeconds(const StageWork& work, const MachineLimits& limits);
bool isBoundByMemory(const StageWork& work, const MachineLimits& limits);

} // namespace surflect::bench
