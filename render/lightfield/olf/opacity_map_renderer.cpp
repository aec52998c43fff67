#include "render/lightfield/olf/opacity_map_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "render/lightfield/lfm/terms_knob.h"
#include "render/lightfield/olf/opacity_map_file.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect::olf {

OpacityMapRenderer::OpacityMapRenderer(const std::filesystem::path& folder, const OpacityMapOptions& options,
                                       const Progress& progress)
    : folder_(folder, kMapFormat, kMapVersion, progress), options_(options), context_(gl::contextOfThread()) {
  lightfield::requireSamples(options.samples);
  const OpacityMaps maps = readMaps(folder_, progress);
  frame_ = std::make_unique<OpacityMapFrame>(maps, context_->describe().limits);
  frameOptions_.order = options.order.value_or(maps.order);
  description_.folder = folder;
  description_.counts = {{"terms", maps.maps.terms.size()},
                         {"triangles", maps.maps.mesh.triangles.size()},
                         {"map_bytes", lfm::bytesOf(maps.maps).total()},
                         {"texture_bytes", frame_->drawing().maps().bytes()},
                         {"auxiliary_bytes", frame_->drawing().mesh().bytes()}};
  description_.rig = folder_.rig();
  description_.middle = middleOf(folder_.mesh().positions);
  description_.points = folder_.mesh().positions;
  turn({});
}

std::vector<knobs::Knob> OpacityMapRenderer::knobs() const {
  std::vector<knobs::Knob> all{lightfield::samplesKnob(options_.samples),
                               lfm::termsKnob(description_.counts.at("terms"))};
  if (frameOptions_.order != Order::peel) return all;
  knobs::Knob& layers = all.emplace_back();
  layers.name = "layers", layers.meaning = "nearest layers of depth that are drawn, at most";
  layers.values = {static_cast<double>(kMostLayers), 8, 4, 3, 2, 1};
  return all;
}

void OpacityMapRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  MapFrameOptions frameOptions = frameOptions_;
  frameOptions.terms = lfm::termsOf(setting, description_.counts.at("terms"));
  frameOptions.layers = lfm::countOf(setting, "layers", {1, kMostLayers}, kMostLayers);
  samples_ = lightfield::samplesOf(setting, options_.samples);
  frameOptions_ = frameOptions;
  description_.identity = fmt::format(
      "opacity light field maps {} order {} terms {} layers {} samples {} driver {} {}",
      hex(folder_.identity()), nameOf(frameOptions_.order), *frameOptions_.terms, frameOptions_.layers,
      samples_, context_->describe().renderer, context_->describe().version);
}

render::FrameLayers OpacityMapRenderer::render(const scene::Scene& scene, const std::vector<std::string>&,
                                               const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  memory.aovs.clear();
  memory.report = {};
  FrameCounts counts;
  memory.color = frame_->render(lightfield::sampledCamera(scene, samples_), frameOptions_,
                                memory.report.seconds, counts, samples_);
  const double samples = lightfield::samplesOf(scene, samples_);
  memory.report.counts = {
      {"work.texels", static_cast<double>(counts.fragments) * static_cast<double>(1 + *frameOptions_.terms)},
      {"work.pixels", samples},
      {"passes", static_cast<double>(counts.passes)},
      {"layers", static_cast<double>(counts.layers)},
      {"fragments", static_cast<double>(counts.fragments)},
      {"texture_bytes", static_cast<double>(frame_->drawing().maps().bytes())}};
  if (!lightfield::showsObject(memory.color)) memory.report.remark = lightfield::kNothingVisible;
  return memory;
}

} // namespace surflect::olf
