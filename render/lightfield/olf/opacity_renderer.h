// The renderer of opacity light fields.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/olf/opacity_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surflect::olf {

struct OpacityOptions {
  int samples = 1;                 // along each side of a pixel, 1..lightfield::kMostSamples
  std::optional<Order> order = {}; // replaces the model's
};

// Belongs to the thread that opens it, as its context does.
class OpacityRenderer : public render::Renderer {
public:
  // Reads a folder, triangulates and uploads its views. Throws Error, also without OpenGL, and Cancelled.
  explicit OpacityRenderer(const std::filesystem::path& folder, const OpacityOptions& options = {},
                           const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  std::vector<knobs::Knob> knobs() const override { return {lightfield::samplesKnob(options_.samples)}; }
  void turn(const knobs::Setting& setting) override;
  // Throws Error as requireBaked() does, and for a camera that is not a pinhole or distorts. It has no AOVs.
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  lightfield::LightFieldFolder folder_;
  const OpacityOptions options_;
  int samples_ = 0; // as the knob is set
  OpacityField field_;
  std::unique_ptr<const ViewBlender> blender_;
  std::shared_ptr<const gl::Context> context_;
  std::unique_ptr<OpacityFrame> frame_; // of the context
  render::Description description_;
};

} // namespace surflect::olf
