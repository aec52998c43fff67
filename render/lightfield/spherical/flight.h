// Frames one after another, each at the level of detail that its time allows.  [Domingo 2007, §4]
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/frame_time_model.h"
#include "render/lightfield/spherical/player.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "render/lightfield/spherical/spherical_frame.h"
#include "srf/capture/camera.h"
#include "surfel/base/time.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace surflect::spherical {

// Choice of the level of detail whose predicted time fits a budget.
//
// [Domingo 2007, §4.2]: the highest level of detail that satisfies the frame rate. Steps upwards go by thirds
// of a level, so that nothing pops, or to the next level that fits where thirds below it cost too much: a
// blend draws two levels, and a coarse level may cost more than a fine one. If a frame does not fit, the
// finest coarser level that fits is taken at once, else one that is finer and fits. If none fits, levels that
// have never been drawn are tried, then images are read at coarser mip levels, and at last what is predicted
// to take least is kept. Finer mip levels are taken again as soon as a level fits with them.
//
// The prediction of a level that was never drawn is a guess from those beside it: upwards, it is tried up to
// twice the budget. Hysteresis: a step upwards needs headroom, and some frames since the last step downwards.
struct ControlOptions {
  double budget = 0.1;    // seconds a frame
  double headroom = 0.92; // share of the budget that a step upwards may use
  int patience = 4;       // frames from a step downwards to one upwards
};

class DetailControl {
public:
  // Predicted seconds of the next frame.
  using Predicted = std::function<double(const Detail&)>;

  // Starts at level 0.
  DetailControl(size_t levels, const ControlOptions& options);

  double budget() const { return options_.budget; }
  // Level of detail of the next frame, in thirds.
  Detail choose(const Predicted& predicted);

private:
  struct Step {
    int thirds = 0, coarser = 0;
    Detail detail() const { return {thirds / 3.0, coarser}; }
  };
  using Fits = std::function<bool(const Step&)>;
  // Step where the present one does not fit. `fits` tells whether one takes at most the budget.
  Step retreat(const Fits& fits, const Predicted& predicted) const;
  // The next step upwards that fits with headroom, or is a guess worth trying; empty if there is none.
  std::optional<Step> advance(const Predicted& predicted) const;
  // Whole level that is predicted to take least.
  Step cheapest(int coarser, const Predicted& predicted) const;
  bool isTried(const Step& step) const;

  int finest_; // in thirds
  ControlOptions options_;
  Step step_;
  int waiting_ = 0;
  std::optional<Step> before_; // the step before the last frame's, which was a guess
  std::array<std::vector<bool>, kMostCoarser + 1> isTried_; // by whole level
};

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
  Detail detail;
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
  Expected expected(const FramePlan& plan, const Detail& detail) const;

  const DirectionTree& tree_;
  ImageCache& cache_;
  FrameTimeModel& model_;
  FlightOptions options_;
  std::optional<DetailControl> control_;
};

// A field in a folder, flown through: its files, its cache and its frames by OpenGL together.

// Times of an image from disk and to the GPU, measured with a frame that has no images yet: start values.
FrameTimes measuredTimes(const SphericalFile& file, SphericalFrame& frame);

// Belongs to the thread that opens it, as its context does.
class OpenFlight {
public:
  // Loads the images of level 0, and measures how long an image takes from disk and to the GPU, as start
  // values of the frame times. Throws Error as SphericalRenderer does, and Cancelled.
  OpenFlight(const std::filesystem::path& folder, const CacheBudgets& budgets, const FlightOptions& options,
             const Progress& progress = {});

  const FieldShape& shape() const { return file_.shape(); }
  const lightfield::LightFieldFolder& folder() const { return folder_; }
  // Draws a frame with samples x samples for each pixel. Throws Error where an image cannot be read, and for
  // a camera that is not a pinhole or distorts.
  FrameRecord frame(const capture::Camera<AcquisitionSpace>& camera, const Look& look, int samples);
  // Picture of the last frame.
  Picture picture() { return frame_.read(false); }
  FrameTimes times(const Detail& detail) const { return model_.times(detail); }

private:
  lightfield::LightFieldFolder folder_;
  SphericalFile file_;
  DirectionTree tree_;
  std::shared_ptr<const gl::Context> context_;
  CacheSlots slots_;
  SphericalFrame frame_;
  TaskLoader loader_;
  FrameTimeModel model_;
  ImageCache cache_;
  Flight flight_;
};

} // namespace surflect::spherical
