// How the cost of a frame grows with surfels, views, lights and pixels.
#pragma once

#include "bench/doll/frame_times.h"
#include "bench/timing/time_ratio.h"
#include "surfel/base/progress.h"

#include <optional>
#include <string>
#include <vector>

namespace surflect::bench {

struct GrowthRow {
  std::string name;
  FrameTimes times;
};

// From one row to another, which has more of one thing; both were timed by turns.
struct GrowthStep {
  size_t from = 0, to = 0;         // rows
  size_t fromSize = 0, toSize = 0; // how much of it they have
  TimeRatio frame;                 // of processor time
  double size() const { return static_cast<double>(toSize) / static_cast<double>(fromSize); }
};

struct GrowthSweep {
  std::string what;              // grows
  std::vector<GrowthStep> steps; // each from where the last one ended

  // Time grows with this power of the size, from the first row to the last.
  double exponent() const;
  // The ratio of times over that of sizes, 1 where time is in proportion: of the step where it is the most.
  TimeRatio worst() const;
};

struct Growth {
  std::vector<GrowthRow> rows;
  std::vector<GrowthSweep> sweeps;
  TimeRatio sixtyLights, environment; // look-ups of them over those of five lights
};

// Frames of dollShot: of all views, half and a quarter of them; of a quarter of the views and once, twice and
// four times the surfels (of dollSurface; left out where the model is not the doll's); of 1, 5 and 60 lights
// and of studioLight; on a picture of this size and of four times its pixels. Each `frames` times. Of a
// model of few views steps are left out that would be none. Throws Error and Cancelled.
Growth measureGrowth(const model::Model& model, int width, int height, int frames,
                     const Progress& progress = {});

} // namespace surflect::bench
