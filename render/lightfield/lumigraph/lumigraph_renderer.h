// The renderer of lumigraphs.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/lumigraph/lumigraph_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace surflect::lumigraph {

struct LumigraphOptions {
  int samples = 1; // along each side of a pixel, 1..lightfield::kMostSamples
};

// Belongs to the thread that opens it, as its context does.
class LumigraphRenderer : public render::Renderer {
public:
  // Reads a folder and uploads its texels. Throws Error, also without OpenGL, and Cancelled.
  explicit LumigraphRenderer(const std::filesystem::path& folder, const LumigraphOptions& options = {},
                             const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  std::vector<knobs::Knob> knobs() const override { return {lightfield::samplesKnob(options_.samples)}; }
  void turn(const knobs::Setting& setting) override;
  // Throws Error as requireBaked() does, and for a camera that is not a pinhole or distorts. AOV: "depth".
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  lightfield::LightFieldFolder folder_;
  const LumigraphOptions options_;
  int samples_ = 0; // as the knob is set
  std::shared_ptr<const gl::Context> context_;
  std::unique_ptr<LumigraphFrame> frame_; // of the context
  render::Description description_;
};

} // namespace surflect::lumigraph
