// A field in a folder, flown through: its files, its cache and its frames by OpenGL together.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/flight.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "render/lightfield/spherical/spherical_frame.h"
#include "srf/capture/camera.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>

namespace surflect::spherical {

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
  FrameTimes times(double detail) const { return model_.times(detail); }

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
