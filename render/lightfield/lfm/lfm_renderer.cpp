#include "render/lightfield/lfm/lfm_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "render/lightfield/lfm/terms_knob.h"
#include "srf/image/resize.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace surflect::lfm {

namespace {

LfmOptions checked(const LfmOptions& options) {
  lightfield::requireSamples(options.samples);
  return options;
}

const char* nameOf(Passes passes) {
  switch (passes) {
  case Passes::single:
    return "single pass";
  case Passes::perTerm:
    return "pass per term";
  case Passes::clamped:
    return "clamped";
  }
  return "";
}

std::string identityOf(uint64_t folder, const LfmOptions& options, const gl::Description& driver) {
  return fmt::format("light field maps {} terms {} {} white {} samples {} driver {} {}", hex(folder),
                     *options.frame.terms, nameOf(options.frame.passes), options.frame.white, options.samples,
                     driver.renderer, driver.version);
}

} // namespace

LfmRenderer::LfmRenderer(const std::filesystem::path& folder, const LfmOptions& options,
                         const Progress& progress)
    : full_(checked(options)), context_(gl::contextOfThread()) {
  OpenedMaps opened = openMaps(folder, progress);
  frames_ = std::make_unique<FrameRenderer>(opened.maps, context_->describe().limits);
  isProgressive_ = opened.maps.method == Method::pca;
  points_ = std::move(opened.maps.mesh.positions);
  description_.folder = folder;
  description_.counts = {{"terms", opened.maps.terms.size()},
                         {"triangles", opened.maps.mesh.triangles.size()},
                         {"map_bytes", bytesOf(opened.maps).total()}};
  description_.rig = opened.folder.rig();
  description_.middle = middleOf(points_);
  description_.points = points_;
  folderIdentity_ = opened.folder.identity();
  turn({});
}

size_t LfmRenderer::fullTerms() const {
  return std::min(description_.counts.at("terms"), full_.frame.terms.value_or(kMostTerms));
}

std::vector<knobs::Knob> LfmRenderer::knobs() const {
  std::vector<knobs::Knob> all{lightfield::samplesKnob(full_.samples)};
  if (isProgressive_) all.push_back(termsKnob(fullTerms()));
  return all;
}

void LfmRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  LfmOptions options = full_;
  options.frame.terms = termsOf(setting, fullTerms());
  options.samples = lightfield::samplesOf(setting, full_.samples);
  options_ = options;
  description_.identity = identityOf(folderIdentity_, options_, context_->describe());
}

render::FrameLayers LfmRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                        const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  const Frame frame = frames_->render(lightfield::sampledCamera(scene, options_.samples), options_.frame);
  memory.color = image::squareMeans(frame.color, options_.samples);
  memory.aovs.clear();
  if (std::ranges::find(aovs, "depth") != aovs.end())
    memory.aovs["depth"] = image::squareMinima(frame.depth, options_.samples);
  memory.report = {};
  memory.report.seconds = {{"depth", frame.stats.depthSeconds},
                           {"draw", frame.stats.drawSeconds},
                           {"read", frame.stats.readSeconds}};
  memory.report.counts = {{"work.texels", lightfield::samplesOf(scene, options_.samples) *
                                              static_cast<double>(1 + frame.stats.terms)},
                          {"passes", static_cast<double>(frame.stats.passes)},
                          {"terms", static_cast<double>(frame.stats.terms)},
                          {"triangles", static_cast<double>(description_.counts.at("triangles"))},
                          {"texture_bytes", static_cast<double>(frames_->textures().bytes())}};
  if (!lightfield::showsObject(frame.color)) memory.report.remark = lightfield::kNothingVisible;
  return memory;
}

} // namespace surflect::lfm
