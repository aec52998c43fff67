#include "render/lightfield/olf/opacity_map_frame.h"

#include "render/gl/draw.h"
#include "render/lightfield/olf/shaders.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace surflect::olf {

OpacityMapFrame::Target::Target(int width, int height)
    : color({gl::Format::rgba32f, width, height}), whole("opacity maps", {{&color}}) {}

OpacityMapFrame::OpacityMapFrame(const OpacityMaps& maps, const gl::Limits& limits)
    : drawing_(maps.maps, limits), list_(kShaders, {"maps.vert", "list_maps.frag"}),
      layerDepth_(kShaders, {"depth.vert", "peel_depth.frag"}),
      layerMaps_(kShaders, {"maps.vert", "layer_maps.frag"}),
      compose_(kShaders, {"picture.vert", "compose_roots.frag"}) {
  for (gl::Program* program : {&list_, &layerMaps_}) drawing_.setMaps(*program);
  for (gl::Program* program : {&list_, &compose_}) program->set("white", static_cast<float>(maps.white));
}

void OpacityMapFrame::drawLists(size_t terms, FrameCounts& counts, const Progress& progress) {
  lfm::MapDrawing::setTerms(list_, {drawing_.hasMean(), 0, terms});
  lists_.draw(target_->whole, list_, drawing_.textures(), drawing_.mesh(), {0, drawing_.mesh().size()},
              counts, progress);
}

size_t OpacityMapFrame::drawLayer(const PeeledLayer& layer, size_t terms, lfm::Passes passes,
                                  FrameCounts& counts, const Progress& progress) {
  const std::array<const gl::Texture*, 1> before{&layer.before};
  layerDepth_.set("isFirst", layer.isFirst ? 1 : 0);
  gl::SteppedDraws(depthStep_, progress)
      .draw({layer.target,
             layerDepth_,
             before,
             {.depth = gl::Compare::less,
              .writeDepth = true,
              .writeColor = {false, false, false, false},
              .cull = gl::Cull::back}},
            drawing_.mesh());
  ++counts.passes;
  const size_t found = layer.fragments.read(0);
  if (found == 0) return 0;
  gl::SteppedDraws draws(mapsStep_, progress);
  const auto draw = [&](const lfm::TermRange& range, const gl::Blend& blend) {
    lfm::MapDrawing::setTerms(layerMaps_, range);
    draws.draw({layer.target,
                layerMaps_,
                drawing_.textures(),
                {.blend = blend, .depth = gl::Compare::equal, .cull = gl::Cull::back}},
               drawing_.mesh());
    ++counts.passes;
  };
  if (passes == lfm::Passes::single) {
    draw({drawing_.hasMean(), 0, terms}, {}); // replaces: of triangles at one place, one is shown
    return found;
  }
  const gl::Blend sum{gl::Factor::one, gl::Factor::one};
  if (drawing_.hasMean()) draw({true, 0, 0}, sum);
  for (size_t k = 0; k < terms; ++k) draw({false, k, k + 1}, sum);
  return found;
}

void OpacityMapFrame::drawLayers(size_t terms, const MapFrameOptions& options, FrameCounts& counts,
                                 const Progress& progress) {
  if (!target_->layers) target_->layers.emplace(target_->whole.width(), target_->whole.height());
  target_->layers->draw(
      target_->whole, target_->color, compose_, options.layers, counts,
      [&](const PeeledLayer& layer) { return drawLayer(layer, terms, options.passes, counts, progress); },
      progress);
}

image::Image OpacityMapFrame::render(const capture::Camera<AcquisitionSpace>& camera,
                                     const MapFrameOptions& options, std::map<std::string, double>& seconds,
                                     FrameCounts& counts, int side, const Progress& progress) {
  assert(options.order != Order::bsp && options.passes != lfm::Passes::clamped);
  const int width = camera.lens.width, height = camera.lens.height;
  if (!target_ || target_->whole.width() != width || target_->whole.height() != height) {
    target_.reset();
    target_.emplace(width, height);
  }
  gl::Stopwatch stopwatch;
  const auto lap = [&](const char* stage) { seconds[stage] += std::exchange(stopwatch, {}).seconds(); };
  const gl::DepthRange range = drawing_.depthRange(camera);
  for (gl::Program* program : {&list_, &layerDepth_, &layerMaps_})
    drawing_.setPosition(*program, camera, range);
  for (gl::Program* program : {&list_, &layerMaps_}) drawing_.setViewer(*program, camera);
  target_->whole.clearColor(0, {0, 0, 0, 0});
  const size_t terms = std::min(options.terms.value_or(drawing_.terms()), drawing_.terms());
  if (options.order == Order::list)
    drawLists(terms, counts, progress);
  else
    drawLayers(terms, options, counts, progress);
  lap("draw");
  image::Image color = means_.read(target_->color, side, progress);
  lap("read");
  return color;
}

} // namespace surflect::olf
