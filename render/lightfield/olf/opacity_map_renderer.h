// The renderer of opacity light field maps.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/olf/opacity_map_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surflect::olf {

struct OpacityMapOptions {
  int samples = 1;                 // along each side of a pixel, 1..lightfield::kMostSamples
  std::optional<Order> order = {}; // replaces the model's
};

// Belongs to the thread that opens it, as its context does.
class OpacityMapRenderer : public render::Renderer {
public:
  // Reads a folder. Throws Error, also without OpenGL, and Cancelled.
  explicit OpacityMapRenderer(const std::filesystem::path& folder, const OpacityMapOptions& options = {},
                              const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  // "samples" and "terms"; with depth peeling also "layers".
  std::vector<knobs::Knob> knobs() const override;
  void turn(const knobs::Setting& setting) override;
  // Throws Error as requireBaked() does, and for a camera that is not a pinhole or distorts. It has no AOVs.
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  lightfield::LightFieldFolder folder_;
  const OpacityMapOptions options_;
  int samples_ = 0; // as the knob is set
  MapFrameOptions frameOptions_;
  std::shared_ptr<const gl::Context> context_;
  std::unique_ptr<OpacityMapFrame> frame_; // of the context
  render::Description description_;
};

} // namespace surflect::olf
