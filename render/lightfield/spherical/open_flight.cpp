#include "render/lightfield/spherical/open_flight.h"

#include "surfel/base/stopwatch.h"

#include <algorithm>

namespace surflect::spherical {

OpenFlight::OpenFlight(const std::filesystem::path& folder, const CacheBudgets& budgets,
                       const FlightOptions& options, const Progress& progress)
    : folder_(folder, kFormat, kVersion, progress), file_(folder_), tree_(file_.shape().levels),
      context_(gl::contextOfThread()),
      slots_(slotsFor(file_.shape(), budgets, static_cast<size_t>(context_->describe().limits.arrayLayers))),
      frame_(tree_, file_.shape(), slots_.gpu), loader_(file_),
      model_(tree_.levels(), measuredTimes(file_, frame_)), cache_(slots_, loader_, frame_),
      flight_(tree_, cache_, model_, options) {}

FrameTimes measuredTimes(const SphericalFile& file, SphericalFrame& frame) {
  constexpr double kLeast = 1e-6; // a clock's step
  const Stopwatch reading;
  const PencilImage image = file.read(0);
  FrameTimes times;
  times.disk = std::max(kLeast, reading.seconds());
  const gl::Stopwatch uploading;
  frame.upload(0, image); // into a slot that nothing has yet
  times.main = std::max(kLeast, uploading.seconds());
  return times;
}

FrameRecord OpenFlight::frame(const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                              int samples) {
  const Stopwatch watch;
  return flight_.frame(windowOf(camera, shape().sphere), look,
                       {[&](const Look& chosen) { frame_.begin(camera, chosen, samples); },
                        [&](std::span<const TexturedTriangle> triangles) { frame_.add(triangles); },
                        [] { gl::finish(); }, [&] { return watch.seconds(); }});
}

} // namespace surflect::spherical
