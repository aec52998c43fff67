// Renderer of spherical light fields: every pencil shows its own image, however long loading takes.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/image_cache.h"
#include "render/lightfield/spherical/look.h"
#include "render/lightfield/spherical/spherical_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace surflect::spherical {

struct SphericalOptions {
  CacheBudgets budgets = {};
  int samples = 1; // along each side of a pixel, 1..lightfield::kMostSamples
};

// Belongs to the thread that opens it, as its context does.
class SphericalRenderer : public render::Renderer {
public:
  // Opens a folder and loads the images of level 0. Throws Error, also without OpenGL and for a budget that
  // is too small; and Cancelled.
  explicit SphericalRenderer(const std::filesystem::path& folder, const SphericalOptions& options = {},
                             const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  // "level", the level of detail; "depth" and "interpolation", 1 or 0; "samples".
  std::vector<knobs::Knob> knobs() const override;
  void turn(const knobs::Setting& setting) override;
  // Throws Error as requireBaked() does, and for a camera that is not a pinhole or distorts. AOV: "depth".
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  lightfield::LightFieldFolder folder_;
  const SphericalOptions options_;
  SphericalFile file_;
  DirectionTree tree_;
  int samples_ = 0; // as the knob is set
  Look look_;       // as the knobs are set
  std::shared_ptr<const gl::Context> context_;
  CacheSlots slots_;
  std::unique_ptr<SphericalFrame> frame_; // of the context
  std::unique_ptr<ImageLoader> loader_;
  std::unique_ptr<ImageCache> cache_;
  render::Description description_;
};

} // namespace surflect::spherical
