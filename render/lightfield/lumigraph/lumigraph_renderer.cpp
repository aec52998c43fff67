#include "render/lightfield/lumigraph/lumigraph_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace surflect::lumigraph {

LumigraphRenderer::LumigraphRenderer(const std::filesystem::path& folder, const LumigraphOptions& options,
                                     const Progress& progress)
    : folder_(folder, kFormat, kVersion, progress), options_(options), context_(gl::contextOfThread()) {
  lightfield::requireSamples(options.samples);
  const Lumigraph lumigraph = readLumigraph(folder_, progress);
  frame_ = std::make_unique<LumigraphFrame>(lumigraph);
  size_t texels = 0;
  for (const Slab& slab : lumigraph.slabs) texels += slab.texels();
  description_.folder = folder;
  description_.counts = {{"nodes", static_cast<size_t>(lumigraph.slabs[0].nodes)},
                         {"texels", texels},
                         {"triangles", lumigraph.geometry.mesh.triangles.size()}};
  description_.rig = folder_.rig();
  description_.middle = middleOf(folder_.mesh().positions);
  description_.points = folder_.mesh().positions;
  turn({});
}

void LumigraphRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  samples_ = lightfield::samplesOf(setting, options_.samples);
  description_.identity = fmt::format("lumigraph {} samples {} driver {} {}", hex(folder_.identity()),
                                      samples_, context_->describe().renderer, context_->describe().version);
}

render::FrameLayers LumigraphRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                              const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  const capture::Camera<AcquisitionSpace> camera = lightfield::sampledCamera(scene, 1);
  memory.aovs.clear();
  memory.report = {};
  const bool isDepthAsked = std::ranges::find(aovs, "depth") != aovs.end();
  LumigraphFrame::Picture picture = frame_->render(camera, {samples_, isDepthAsked}, memory.report.seconds);
  memory.color = std::move(picture.color);
  if (isDepthAsked) memory.aovs["depth"] = std::move(picture.depth);
  memory.report.counts = {{"work.pixels", lightfield::samplesOf(scene, samples_)},
                          {"triangles", static_cast<double>(frame_->triangles())},
                          {"texture_bytes", static_cast<double>(frame_->textureBytes())}};
  if (!lightfield::showsObject(memory.color)) memory.report.remark = lightfield::kNothingVisible;
  return memory;
}

} // namespace surflect::lumigraph
