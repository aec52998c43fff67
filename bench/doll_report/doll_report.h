// What bench_doll has measured, as one JSON object and as tables.
#pragma once

#include "bench/doll/bounded_frames.h"
#include "bench/doll/frame_times.h"
#include "bench/doll/growth.h"
#include "bench/doll/look_up_orders.h"
#include "bench/doll/machine.h"
#include "bench/doll/paper_frame.h"
#include "bench/packing/packing_times.h"
#include "bench/quality/packing_quality.h"
#include "bench/splat/splat_times.h"
#include "bench/warp/warp_times.h"

#include <filesystem>
#include <string>
#include <vector>

namespace surflect::bench {

// How near the frame comes to the paper's, both over the latter's white.
struct FrameCheck {
  double psnrDb = 0, largest = 0;
  static constexpr double kLeastDb = 100;
  bool passed() const { return psnrDb >= kLeastDb; }
};

// Some blocks of some views of the light stage's doll (examples/stages/doll.toml).
struct StageDoll {
  static constexpr double kBytes = 0.6; // at most, for each pixel and light
  std::string scale;                    // of the stage
  size_t views = 0, allViews = 0;
  size_t every = 1; // block of these views
  PackingQuality quality;
};

struct DollMeasurements {
  std::filesystem::path model;
  int width = 0, height = 0; // of the frame
  MachineLimits machine;
  FrameCheck check;
  FrameTimes frame;
  PaperFrame paper;
  Lap paperLap; // on one thread, with all blocks in memory
  Growth growth;
  BoundedFrames bounded;
  std::vector<OrderCost> orders;
  PackingTimes packing;
  StageDoll stageDoll;
  std::vector<SplatTimes> splats;
  std::vector<WarpTimes> warps;
};

// One JSON object; times are in the unit of their name. `marks` says how far each aim is reached that the
// program has set itself.
std::string jsonReport(const DollMeasurements& measured);

// The same as tables.
std::string textReport(const DollMeasurements& measured);

} // namespace surflect::bench
