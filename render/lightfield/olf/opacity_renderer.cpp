#include "render/lightfield/olf/opacity_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "render/lightfield/olf/opacity_file.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <utility>

namespace surflect::olf {

OpacityRenderer::OpacityRenderer(const std::filesystem::path& folder, const OpacityOptions& options,
                                 const Progress& progress)
    : folder_(folder, kFormat, kVersion, progress), options_(options), context_(gl::contextOfThread()) {
  lightfield::requireSamples(options.samples);
  field_ = readField(folder_, progress);
  if (options.order) field_.order = *options.order;
  blender_ = std::make_unique<const ViewBlender>(field_, progress);
  frame_ = std::make_unique<OpacityFrame>(field_, field_.order, progress);
  field_.packed.texels = {}; // the driver has them now
  description_.folder = folder;
  description_.counts = {{"views", field_.cameras.size()},
                         {"triangles", field_.mesh.triangles.size()},
                         {"pieces", frame_->pieces()},
                         {"texture_bytes", frame_->textureBytes()}};
  size_t auxiliary = 0;
  for (const auto& parts : {blender_->bytes(), frame_->auxiliaryBytes()})
    for (const auto& [part, bytes] : parts) {
      description_.counts[part] = bytes;
      auxiliary += bytes;
    }
  description_.counts["auxiliary_bytes"] = auxiliary;
  description_.rig = folder_.rig();
  description_.middle = middleOf(folder_.mesh().positions);
  description_.points = folder_.mesh().positions;
  turn({});
}

void OpacityRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  samples_ = lightfield::samplesOf(setting, options_.samples);
  description_.identity = fmt::format("opacity light field {} order {} samples {} driver {} {}",
                                      hex(folder_.identity()), nameOf(field_.order), samples_,
                                      context_->describe().renderer, context_->describe().version);
}

render::FrameLayers OpacityRenderer::render(const scene::Scene& scene, const std::vector<std::string>&,
                                            const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  const capture::Camera<AcquisitionSpace> camera = lightfield::sampledCamera(scene, samples_);
  memory.aovs.clear();
  memory.report = {};
  const std::vector<TriangleBlend> blends = blender_->blends(camera.center().raw(), &memory.report.seconds);
  FrameCounts counts;
  memory.color = frame_->render(camera, blends, memory.report.seconds, counts, samples_);
  memory.report.counts = {{"work.pixels", lightfield::samplesOf(scene, samples_)},
                          {"passes", static_cast<double>(counts.passes)},
                          {"fragments", static_cast<double>(counts.fragments)},
                          {"pieces", static_cast<double>(frame_->pieces())},
                          {"texture_bytes", static_cast<double>(frame_->textureBytes())}};
  if (!lightfield::showsObject(memory.color)) memory.report.remark = lightfield::kNothingVisible;
  return memory;
}

} // namespace surflect::olf
