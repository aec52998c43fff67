#include "render/lightfield/slf/slf_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace surflect::slf {

namespace {

SlfOptions checked(SlfOptions options) {
  lightfield::requireSamples(options.samples);
  if (options.frame.basis == Basis::gouraud) options.frame.method = Method::twoStages;
  return options;
}

std::string identityOf(const OpenedField& opened, const SlfOptions& options, int samples,
                       const gl::Description& driver) {
  return fmt::format("surface light field {} {}{} samples {} driver {} {}", hex(opened.folder.identity()),
                     options.frame.method == Method::fused ? "fused" : "two stages",
                     options.frame.basis == Basis::gouraud ? " gouraud" : "", samples, driver.renderer,
                     driver.version);
}

render::FrameReport reportOf(const Frame& frame) {
  const FrameStats& stats = frame.stats;
  const auto count = [](size_t number) { return static_cast<double>(number); };
  render::FrameReport report;
  report.seconds = {{"overhead", stats.planSeconds},
                    {"texture", stats.textures.seconds},
                    {"draw", stats.drawSeconds},
                    {"read", stats.readSeconds}};
  report.counts = {{"regions", count(stats.regions)},
                   {"passes", count(stats.passes)},
                   {"passes_all", count(stats.allPasses)},
                   {"triangles", count(stats.triangles)},
                   {"texture_hits", count(stats.textures.hits)},
                   {"texture_misses", count(stats.textures.misses)},
                   {"texture_bytes", count(stats.textures.bytes)}};
  if (!lightfield::showsObject(frame.color)) report.remark = lightfield::kNothingVisible;
  return report;
}

} // namespace

SlfRenderer::SlfRenderer(const std::filesystem::path& folder, const SlfOptions& options,
                         const Progress& progress)
    : options_(checked(options)), context_(gl::contextOfThread()), opened_(openField(folder, progress)),
      frames_(opened_.field, *opened_.textures, options_.slots, context_->describe().limits) {
  const Field& field = opened_.field;
  description_.folder = folder;
  description_.counts = {{"regions", field.regions.size()},
                         {"textures", field.textures()},
                         {"triangles", field.mesh.triangles.size()}};
  description_.rig = opened_.folder.rig();
  description_.middle = middleOf(field.mesh.positions);
  description_.points = field.mesh.positions;
  turn({});
}

void SlfRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  samples_ = lightfield::samplesOf(setting, options_.samples);
  description_.identity = identityOf(opened_, options_, samples_, context_->describe());
}

render::FrameLayers SlfRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                        const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  const auto isAsked = [&](const char* name) { return std::ranges::find(aovs, name) != aovs.end(); };
  FrameOptions options = options_.frame;
  options.observed = isAsked("observed");
  const Frame frame = frames_.render(lightfield::sampledCamera(scene, samples_), options);
  memory.color = image::squareMeans(frame.color, samples_);
  memory.aovs.clear();
  if (options.observed) memory.aovs["observed"] = image::squareMeans(frame.observed, samples_);
  if (isAsked("depth")) memory.aovs["depth"] = image::squareMinima(frame.depth, samples_);
  memory.report = reportOf(frame);
  memory.report.counts["work.pixels"] = lightfield::samplesOf(scene, samples_);
  return memory;
}

} // namespace surflect::slf
