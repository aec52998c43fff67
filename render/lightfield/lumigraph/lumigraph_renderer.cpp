#include "render/lightfield/lumigraph/lumigraph_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <utility>

namespace surflect::lumigraph {

LumigraphRenderer::LumigraphRenderer(const std::filesystem::path& folder, const LumigraphOptions& options,
                                     const Progress& progress)
    : folder_(folder, kFormat, kVersion, progress), options_(options), context_(gl::contextOfThread()) {
  if (options.samples < 1 || options.samples > 8)
    throw Error::mismatch("1..8", std::to_string(options.samples)).at("samples");
  const Lumigraph lumigraph = readLumigraph(folder_, options.triangles, progress);
  frame_ = std::make_unique<LumigraphFrame>(lumigraph);
  size_t texels = 0;
  for (const Slab& slab : lumigraph.slabs) texels += slab.texels();
  description_.folder = folder;
  description_.identity =
      fmt::format("lumigraph {} triangles {} samples {} driver {} {}", hex(folder_.identity()),
                  lumigraph.geometry.triangles.size(), options.samples, context_->describe().renderer,
                  context_->describe().version);
  description_.counts = {{"nodes", static_cast<size_t>(lumigraph.slabs[0].nodes)},
                         {"texels", texels},
                         {"triangles", lumigraph.geometry.triangles.size()}};
  description_.rig = folder_.rig();
  description_.middle = middleOf(folder_.mesh().positions);
  description_.points = folder_.mesh().positions;
}

render::FrameLayers LumigraphRenderer::render(const scene::Scene& scene, const std::vector<std::string>&,
                                              const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  // Nothing is warped, so object space is acquisition space.
  const auto& pose = scene.camera.cameraFromWorld;
  const capture::Camera<AcquisitionSpace> camera{scene.camera.lens, {pose.rotation(), pose.translation()}};
  memory.aovs.clear();
  memory.report = {};
  memory.color = frame_->render(camera, options_.samples, memory.report.seconds);
  memory.report.counts = {{"triangles", static_cast<double>(frame_->triangles())},
                          {"texture_bytes", static_cast<double>(frame_->textureBytes())}};
  return memory;
}

} // namespace surflect::lumigraph
