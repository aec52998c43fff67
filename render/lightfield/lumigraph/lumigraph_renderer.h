// The renderer of lumigraphs.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lumigraph/lumigraph_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surflect::lumigraph {

struct LumigraphOptions {
  std::optional<size_t>
      triangles;   // of the geometry that corrects depth, instead of those of the folder; 0: all
  int samples = 1; // along each side of a pixel, 1..8
};

// Belongs to the thread that opens it, as its context does.
class LumigraphRenderer : public render::Renderer {
public:
  // Reads a folder and uploads its texels. Throws Error, also without OpenGL, and Cancelled.
  explicit LumigraphRenderer(const std::filesystem::path& folder, const LumigraphOptions& options = {},
                             const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  // Throws Error as requireBaked() does, and for a camera that is not a pinhole or distorts. Has no AOVs.
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  lightfield::LightFieldFolder folder_;
  LumigraphOptions options_;
  std::shared_ptr<const gl::Context> context_;
  std::unique_ptr<LumigraphFrame> frame_; // of the context
  render::Description description_;
};

} // namespace surflect::lumigraph
