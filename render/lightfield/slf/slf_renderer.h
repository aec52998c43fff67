// The renderer of surface light fields.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/slf/open_field.h"
#include "render/lightfield/slf/slf_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace surflect::slf {

struct SlfOptions {
  FrameOptions frame = {}; // `observed` is ignored
  SlotOptions slots = {};
  int samples = 1; // along each side of a pixel, 1..lightfield::kMostSamples
};

// Belongs to the thread that opens it, as its context does.
class SlfRenderer : public render::Renderer {
public:
  // Reads a folder, but for its textures. Throws Error, also without OpenGL, and Cancelled.
  explicit SlfRenderer(const std::filesystem::path& folder, const SlfOptions& options = {},
                       const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  std::vector<knobs::Knob> knobs() const override { return {lightfield::samplesKnob(options_.samples)}; }
  void turn(const knobs::Setting& setting) override;
  // AOVs: "depth", and "observed", the share of a pixel's radiance that photographs observed. Throws Error as
  // requireBaked() and FrameRenderer::render() do.
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  const SlfOptions options_;
  const std::shared_ptr<const gl::Context> context_;
  const OpenedField opened_;
  FrameRenderer frames_; // of the context
  int samples_ = 0;      // as the knob is set
  render::Description description_;
};

} // namespace surflect::slf
