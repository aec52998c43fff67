#include "render/lightfield/lfm/lfm_frame.h"

#include "render/gl/draw.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/shaders.h"
#include "surfel/base/time.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

// Distance along the viewing axis of a depth 0..1.
float distanceOf(float depth, const gl::DepthRange& range) {
  const double distance = range.far * range.near / (range.far - depth * (range.far - range.near));
  return static_cast<float>(distance);
}

} // namespace

FrameRenderer::Targets::Targets(gl::Format format, int width, int height)
    : color({format, width, height}), depth({gl::Format::depth32f, width, height}),
      framebuffer("light field maps", {{&color}}, {&depth}) {}

FrameRenderer::FrameRenderer(const LightFieldMaps& maps, const gl::Limits& limits)
    : isSigned_(maps.method == Factorization::pca), drawing_(maps, limits),
      depth_(kShaders, {"depth.vert", "depth.frag"}), maps_(kShaders, {"maps.vert", "maps.frag"}) {
  drawing_.setMaps(maps_);
}

FrameRenderer::Targets& FrameRenderer::targetsOf(gl::Format format, int width, int height) {
  if (targets_) {
    const gl::TextureShape& shape = targets_->color.shape();
    if (shape.format == format && shape.width == width && shape.height == height) return *targets_;
    targets_.reset();
  }
  return targets_.emplace(format, width, height);
}

Frame FrameRenderer::render(const capture::Camera<AcquisitionSpace>& camera, const FrameOptions& options,
                            const Progress& progress) {
  const gl::DepthRange range = drawing_.depthRange(camera);
  for (gl::Program* program : {&depth_, &maps_})
    drawing_.setPosition(*program, camera, range); // refuses lenses
  drawing_.setViewer(maps_, camera);
  const bool isClamped = options.passes == Passes::clamped;
  Targets& targets =
      targetsOf(isClamped ? gl::Format::rgba8 : gl::Format::rgba32f, camera.lens.width, camera.lens.height);
  Frame frame;
  gl::Stopwatch stopwatch;
  const auto lap = [&] { return std::exchange(stopwatch, {}).seconds(); };
  targets.framebuffer.clearColor(0, {0, 0, 0, 0});
  targets.framebuffer.clearDepth();
  gl::SteppedDraws(depthStep_, progress)
      .draw({targets.framebuffer,
             depth_,
             {},
             {.depth = gl::Compare::less,
              .writeDepth = true,
              .writeColor = {false, false, false, false},
              .cull = gl::Cull::back}},
            drawing_.mesh());
  frame.stats.depthSeconds = lap();
  drawAll(options, progress, frame.stats);
  frame.stats.drawSeconds = lap();

  progress.checkpoint();
  frame.color = targets.color.read();
  progress.checkpoint();
  frame.depth = targets.depth.read();
  const float white = isClamped ? static_cast<float>(options.white) : 1;
  for (size_t i = 0; i < frame.depth.values.size(); ++i) {
    progress.checkNowAndThen(i);
    float& depth = frame.depth.values[i];
    const bool isObject = depth < 1;
    for (size_t channel = 0; channel < 3; ++channel) {
      float& value = frame.color.values[4 * i + channel];
      value = isObject ? white * radianceOf(value) : 0.f;
    }
    frame.color.values[4 * i + 3] = isObject ? 1.f : 0.f;
    depth = isObject ? distanceOf(depth, range) : std::numeric_limits<float>::infinity();
  }
  frame.stats.readSeconds = lap();
  return frame;
}

void FrameRenderer::drawAll(const FrameOptions& options, const Progress& progress, FrameStats& stats) {
  gl::SteppedDraws draws(mapsStep_, progress);
  const size_t terms = stats.terms = std::min(options.terms.value_or(drawing_.terms()), drawing_.terms());
  const auto draw = [&](const TermRange& range, float factor, bool isSubtracted = false) {
    drawTerms(range, factor, isSubtracted, options, draws);
    ++stats.passes;
  };
  if (options.passes == Passes::single) return draw({drawing_.hasMean(), 0, terms}, 1);
  const bool isClamped = options.passes == Passes::clamped;
  const float factor = isClamped ? static_cast<float>(1 / rootOf(options.white)) : 1;
  if (drawing_.hasMean()) draw({true, 0, 0}, factor);
  for (size_t k = 0; k < terms; ++k) {
    draw({false, k, k + 1}, factor);
    if (isClamped && isSigned_) draw({false, k, k + 1}, -factor, true);
  }
}

void FrameRenderer::drawTerms(const TermRange& range, float factor, bool isSubtracted,
                              const FrameOptions& options, gl::SteppedDraws& draws) {
  MapDrawing::setTerms(maps_, range);
  maps_.set("factor", factor);
  maps_.set("cutsNegative", options.passes == Passes::clamped ? 1 : 0);
  const auto textures = drawing_.textures();
  draws.draw({targets_->framebuffer,
              maps_,
              textures,
              {.blend = {gl::Factor::one, gl::Factor::one,
                         isSubtracted ? gl::Equation::subtract : gl::Equation::add},
               .depth = gl::Compare::equal,
               .writeColor = {true, true, true, false},
               .cull = gl::Cull::back}},
             drawing_.mesh());
}

} // namespace surflect::lfm
