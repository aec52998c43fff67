#include "bench/doll/bounded_frames.h"

#include "surfel/base/memory_use.h"

namespace surflect::bench {

namespace {

double surfelBytes(const model::Model& model) {
  const SurfelCloud& cloud = model.cloud;
  const double each =
      sizeof cloud.p0[0] + sizeof cloud.r0[0] + sizeof cloud.radius[0] + sizeof cloud.coverage[0];
  return static_cast<double>(cloud.size()) * (each + static_cast<double>(model.rig.views.size()));
}

} // namespace

BoundedFrames boundedFrames(const model::Model& model, const Shot& shot, size_t cacheBytes) {
  BoundedFrames result{cacheBytes, surfelBytes(model)};
  forgetFiles(model);
  forgetPeakMemory();
  {
    codec::BlockCache cache(model.files, cacheBytes);
    surfels::FrameMemory memory;
    const auto render = [&] {
      surfels::FrameStats stats;
      memory.film = surfels::renderFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, cache,
                                         stats, {}, &memory);
    };
    result.coldSeconds = lapOf(render).seconds;
    result.warmSeconds = lapOf(render).seconds;
    result.frameBytes =
        static_cast<double>(memory.film.color.values.size() * sizeof memory.film.color.values[0]);
    result.anonymousBytes = memoryUse().anonymousBytes;
  }
  result.peakBytes = memoryUse().peakBytes;
  return result;
}

} // namespace surflect::bench
