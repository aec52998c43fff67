#include "render/lightfield/spherical/spherical_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/spherical/player.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace surflect::spherical {

namespace {

// Value of a knob; `full` if the setting does not name it. Throws Error outside lowest..highest, and for a
// switch that is neither 0 nor 1.
double valueOf(const knobs::Setting& setting, const std::string& name, double full, double highest) {
  const auto found = setting.find(name);
  if (found == setting.end()) return full;
  if (!(found->second >= 0 && found->second <= highest))
    throw Error::mismatch("a number from 0 to " + numberText(highest), numberText(found->second))
        .at(name)
        .at("knob");
  return found->second;
}

bool switchOf(const knobs::Setting& setting, const std::string& name) {
  const double value = valueOf(setting, name, 1, 1);
  if (value != 0 && value != 1) throw Error::mismatch("0 or 1", numberText(value)).at(name).at("knob");
  return value == 1;
}

} // namespace

SphericalRenderer::SphericalRenderer(const std::filesystem::path& folder, const SphericalOptions& options,
                                     const Progress& progress)
    : folder_(folder, kFormat, kVersion, progress), options_(options), file_(folder_),
      tree_(file_.shape().levels), context_(gl::contextOfThread()),
      slots_(slotsFor(file_.shape(), options.budgets,
                      static_cast<size_t>(context_->describe().limits.arrayLayers))) {
  lightfield::requireSamples(options.samples);
  frame_ = std::make_unique<SphericalFrame>(tree_, file_.shape(), slots_.gpu);
  loader_ = std::make_unique<TaskLoader>(file_);
  cache_ = std::make_unique<ImageCache>(slots_, *loader_, *frame_);
  description_.folder = folder;
  description_.counts = {{"levels", file_.shape().levels},
                         {"images", file_.shape().images()},
                         {"image_size", static_cast<size_t>(file_.shape().size)}};
  description_.rig = folder_.rig();
  description_.middle = middleOf(folder_.mesh().positions);
  description_.points = folder_.mesh().positions;
  turn({});
}

std::vector<knobs::Knob> SphericalRenderer::knobs() const {
  knobs::Knob level{"level", "level of detail: pencils of level n, and with a fraction also of n + 1", {}};
  for (size_t l = file_.shape().levels; l-- > 0;) level.values.push_back(static_cast<double>(l));
  return {level,
          {"interpolation", "1: blends neighbouring pencils; 0: shows one for each pixel", {1, 0}},
          {"depth", "1: rays meet the depths of an image; 0: its plane", {1, 0}},
          lightfield::samplesKnob(options_.samples)};
}

void SphericalRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  const auto finest = static_cast<double>(file_.shape().levels - 1);
  const Look look{valueOf(setting, "level", finest, finest), 0, switchOf(setting, "depth"),
                  switchOf(setting, "interpolation")};
  samples_ = lightfield::samplesOf(setting, options_.samples);
  look_ = look;
  description_.identity =
      fmt::format("spherical {} level {} depth {} interpolation {} samples {} driver {} {}",
                  hex(folder_.identity()), look_.detail, look_.depth, look_.interpolated, samples_,
                  context_->describe().renderer, context_->describe().version);
}

render::FrameLayers SphericalRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                              const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  const capture::Camera<AcquisitionSpace> camera = lightfield::sampledCamera(scene, 1);
  memory.aovs.clear();
  memory.report = {};
  const bool isDepthAsked = std::ranges::find(aovs, "depth") != aovs.end();
  gl::Stopwatch stopwatch;
  const auto lap = [&](const char* stage) {
    memory.report.seconds[stage] += stopwatch.seconds();
    stopwatch = {};
  };
  const FramePlan plan = planFrame(tree_, windowOf(camera, file_.shape().sphere), look_);
  frame_->begin(camera, look_, samples_);
  lap("plan");
  const FrameCounts counts = drawAll(
      plan, *cache_, [&](std::span<const TexturedTriangle> triangles) { frame_->add(triangles); }, progress);
  lap("draw");
  Picture picture = frame_->read(isDepthAsked);
  lap("read");
  memory.color = std::move(picture.color);
  if (isDepthAsked) memory.aovs["depth"] = std::move(picture.depth);
  const double layers = static_cast<double>(levelShares(look_.detail, tree_.levels()).size()) *
                        (look_.interpolated ? 6 : 1) * (look_.depth ? 8 : 1);
  memory.report.counts = {{"work.pixels", layers * lightfield::samplesOf(scene, samples_)},
                          {"work.triangles", 1e3 * static_cast<double>(counts.triangles)},
                          {"triangles", static_cast<double>(counts.triangles)},
                          {"images", static_cast<double>(plan.images.size())},
                          {"images_uploaded", static_cast<double>(counts.uploads)},
                          {"images_read", static_cast<double>(counts.reads)},
                          {"passes", static_cast<double>(counts.batches)},
                          {"texture_bytes", static_cast<double>(frame_->textureBytes())}};
  if (!lightfield::showsObject(memory.color)) memory.report.remark = lightfield::kNothingVisible;
  return memory;
}

} // namespace surflect::spherical
