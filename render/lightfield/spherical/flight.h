// Frames one after another, each at the level of detail that its time allows.  [Domingo 2007, §4]
#pragma once

#include "render/lightfield/spherical/detail_control.h"
#include "render/lightfield/spherical/frame_time_model.h"
#include "render/lightfield/spherical/player.h"

#include <functional>
#include <optional>

namespace surflect::spherical {

// Target of a flight's frames, and its clock.
struct Canvas {
  std::function<void(const Look&)> begin;
  DrawTriangles draw;
  std::function<void()> end;     // returns when the picture is finished
  std::function<double()> clock; // seconds
};

struct FlightOptions {
  std::optional<double> budget = {}; // seconds a frame; none: all frames have the level of detail of the look
  // Frames wait for all their images, as in [Domingo 2007, Fig. 5]. Otherwise they show images that are on
  // the GPU, and bring no more images there than the budget allows.
  bool wait = false;
};

struct FrameRecord {
  double detail = 0;
  double predicted = 0, seconds = 0;
  FrameCounts counts;
};

class Flight {
public:
  // Tree, cache and model must outlive the flight.
  Flight(const DirectionTree& tree, ImageCache& cache, FrameTimeModel& model, const FlightOptions& options);

  // Draws a frame, and fits the model to its time. Throws Error where an image cannot be read.
  FrameRecord frame(const Window& window, Look look, const Canvas& canvas);

private:
  // Expected work of a frame, and the largest number of images that it may bring to the GPU.
  struct Expected {
    FrameCounts counts;
    size_t mostUploads = 0;
  };
  Expected expected(const FramePlan& plan, double detail) const;

  const DirectionTree& tree_;
  ImageCache& cache_;
  FrameTimeModel& model_;
  FlightOptions options_;
  std::optional<DetailControl> control_;
};

} // namespace surflect::spherical
