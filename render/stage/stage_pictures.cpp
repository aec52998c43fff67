#include "render/stage/stage_pictures.h"

#include "srf/capture/writer.h"
#include "srf/image/png.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace surflect::stage {

namespace {

// Frames of a view, which are contiguous in a plan.
std::span<const capture::Frame> framesOf(const StagePlan& plan, size_t view) {
  return std::ranges::equal_range(plan.capture.frames, view, {}, &capture::Frame::view);
}

image::Precision precisionFor(const TracedView& view) {
  constexpr float kLargestHalf = 65504;
  const auto fits = [](const image::Image& image) {
    return std::ranges::all_of(image.values, [](float value) { return value <= kLargestHalf; });
  };
  return std::ranges::all_of(view.radiance, fits) ? image::Precision::half : image::Precision::single;
}

} // namespace

TracedView trace(const StageScene& scene, const Stage& stage, const StagePlan& plan, size_t view,
                 const Progress& progress) {
  std::vector<capture::Light> lights;
  for (const capture::Frame& frame : framesOf(plan, view))
    lights.push_back(plan.capture.lights[*frame.light]);
  const size_t number = plan.views[view];
  return traceView(scene, stage.rig.views[number].camera, number, lights, stage.trace, progress);
}

void write(const TracedView& traced, const Stage& stage, const StagePlan& plan, size_t view,
           const std::filesystem::path& folder, const Progress& progress) {
  const std::span<const capture::Frame> frames = framesOf(plan, view);
  if (stage.exposure) {
    for (size_t i = 0; i < frames.size(); ++i) {
      const std::vector<capture::Exposure> bracket = capture::bracketOf(frames[i]);
      for (size_t shot = 0; shot < bracket.size(); ++shot) {
        progress.checkpoint();
        image::writePng(folder / bracket[shot].picture,
                        exposed(traced.radiance[i], traced.alpha, *stage.exposure,
                                {stage.trace.seed, plan.views[view], *frames[i].light, shot}),
                        8, stage.exposure->isSrgb ? image::PngColors::srgb : image::PngColors::unstated);
      }
    }
    return;
  }
  std::vector<capture::RadianceLayer> layers;
  for (size_t i = 0; i < frames.size(); ++i) layers.push_back({frames[i].layer, &traced.radiance[i]});
  capture::writeViewPictures(folder / frames[0].picture, layers, &traced.alpha, frames[0].alphaLayer,
                             precisionFor(traced), progress);
}

model::ViewPictures asRead(TracedView traced, const Progress& progress) {
  const image::Precision precision = precisionFor(traced);
  model::ViewPictures view;
  view.hasMatte = true;
  view.stack.width = traced.alpha.width;
  view.stack.height = traced.alpha.height;
  view.stack.alpha = traced.alpha;
  image::roundTo(precision, view.stack.alpha.values);
  const std::vector<float>&whole = traced.alpha.values, &kept = view.stack.alpha.values;
  std::vector<size_t> invalid(traced.radiance.size());
  tbb::parallel_for(size_t{0}, traced.radiance.size(), [&](size_t light) {
    progress.checkpoint();
    std::vector<float>& values = traced.radiance[light].values;
    for (size_t i = 0; i < values.size(); ++i) values[i] *= whole[i / 3];
    image::roundTo(precision, values);
    for (size_t i = 0; i < kept.size(); ++i) {
      bool isValid = true;
      for (float* value = &values[3 * i]; value != &values[3 * i] + 3; ++value) {
        *value = kept[i] > 0 ? *value / kept[i] : 0;
        isValid = isValid && std::isfinite(*value);
      }
      if (isValid) continue;
      std::fill_n(&values[3 * i], 3, 0.f);
      ++invalid[light];
    }
  });
  for (const size_t count : invalid) view.invalidTexels += count;
  view.stack.lights = std::move(traced.radiance);
  return view;
}

bool isFinished(const StagePlan& plan, size_t view, const std::filesystem::path& folder) {
  try {
    std::filesystem::path last; // frames may share a file
    for (const capture::Frame& frame : framesOf(plan, view))
      for (const capture::Exposure& shot : capture::bracketOf(frame)) {
        if (shot.picture == last) continue;
        last = shot.picture;
        if (!std::filesystem::exists(folder / last)) return false;
        if (last.extension() == ".exr")
          const image::ExrFile header(folder / last);
        else
          image::readPngHeader(folder / last);
      }
    return true;
  } catch (const Error&) {
    return false;
  }
}

} // namespace surflect::stage
