#include "render/lightfield/slf/slf_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

namespace surflect::slf {

namespace {

SlfOptions checked(SlfOptions options) {
  if (options.samples < 1 || options.samples > 8)
    throw Error::mismatch("1..8", std::to_string(options.samples)).at("samples");
  if (options.frame.basis == Basis::gouraud) options.frame.method = Method::twoStages;
  return options;
}

std::string identityOf(const OpenedField& opened, const SlfOptions& options, const gl::Description& driver) {
  return fmt::format("surface light field {} {}{} samples {} driver {} {}", hex(opened.folder.identity()),
                     options.frame.method == Method::fused ? "fused" : "two stages",
                     options.frame.basis == Basis::gouraud ? " gouraud" : "", options.samples,
                     driver.renderer, driver.version);
}

// Picture with the mean of each square of `side` x `side` pixels.
image::Image averaged(const image::Image& picture, int side) {
  if (side == 1) return picture;
  image::Image result(picture.width / side, picture.height / side, picture.channels);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const std::span<const float> from = picture.at(x, y);
      const std::span<float> to = result.at(x / side, y / side);
      for (size_t channel = 0; channel < to.size(); ++channel) to[channel] += from[channel];
    }
  for (float& value : result.values) value /= static_cast<float>(side * side);
  return result;
}

// Picture with the least value of each square.
image::Image nearest(const image::Image& picture, int side) {
  if (side == 1) return picture;
  image::Image result(picture.width / side, picture.height / side, 1);
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) {
      float least = picture.at(x * side, y * side)[0];
      for (int k = 1; k < side * side; ++k)
        least = std::min(least, picture.at(x * side + k % side, y * side + k / side)[0]);
      result.at(x, y)[0] = least;
    }
  return result;
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
  bool isVisible = false;
  for (size_t i = 3; i < frame.color.values.size(); i += 4) isVisible |= frame.color.values[i] > 0;
  if (!isVisible) report.remark = "no part of the object is visible";
  return report;
}

} // namespace

SlfRenderer::SlfRenderer(const std::filesystem::path& folder, const SlfOptions& options,
                         const Progress& progress)
    : options_(checked(options)), context_(gl::contextOfThread()), opened_(openField(folder, progress)),
      frames_(opened_.field, *opened_.textures, options_.slots, context_->describe().limits) {
  const Field& field = opened_.field;
  description_.folder = folder;
  description_.identity = identityOf(opened_, options_, context_->describe());
  description_.counts = {{"regions", field.regions.size()},
                         {"textures", field.textures()},
                         {"triangles", field.mesh.triangles.size()}};
  description_.rig = opened_.folder.rig();
  description_.middle = middleOf(field.mesh.positions);
  description_.points = field.mesh.positions;
}

render::FrameLayers SlfRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                        const Progress& progress, render::FrameLayers memory) {
  progress.checkpoint();
  lightfield::requireBaked(scene, description_.rig, description_.points);
  const auto isAsked = [&](const char* name) { return std::ranges::find(aovs, name) != aovs.end(); };
  // Nothing is warped, so object space is acquisition space.
  const auto& pose = scene.camera.cameraFromWorld;
  const capture::Lens& lens = scene.camera.lens;
  const capture::Camera<AcquisitionSpace> camera{
      capture::resized(lens, options_.samples * lens.width, options_.samples * lens.height),
      {pose.rotation(), pose.translation()}};
  FrameOptions options = options_.frame;
  options.observed = isAsked("observed");
  const Frame frame = frames_.render(camera, options);
  memory.color = averaged(frame.color, options_.samples);
  memory.aovs.clear();
  if (options.observed) memory.aovs["observed"] = averaged(frame.observed, options_.samples);
  if (isAsked("depth")) memory.aovs["depth"] = nearest(frame.depth, options_.samples);
  memory.report = reportOf(frame);
  return memory;
}

} // namespace surflect::slf
