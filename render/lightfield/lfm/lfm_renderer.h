// The renderer of light field maps.
#pragma once

#include "render/gl/context.h"
#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/lfm_frame.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace surflect::lfm {

struct LfmOptions {
  FrameOptions frame = {};
  int samples = 1; // along each side of a pixel, 1..lightfield::kMostSamples
};

// Belongs to the thread that opens it, as its context does.
class LfmRenderer : public render::Renderer {
public:
  // Reads a folder. Throws Error, also without OpenGL, and Cancelled.
  explicit LfmRenderer(const std::filesystem::path& folder, const LfmOptions& options = {},
                       const Progress& progress = {});

  const render::Description& describe() const override { return description_; }
  // "samples"; with PCA also "terms". Terms of NMF have no order, so that the first of them approximate
  // nothing.
  std::vector<knobs::Knob> knobs() const override;
  void turn(const knobs::Setting& setting) override;
  // AOV: "depth". Throws Error as requireBaked() and FrameRenderer::render() do.
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, render::FrameLayers memory = {}) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress&) override { return {}; }

private:
  size_t fullTerms() const;

  const LfmOptions full_;
  LfmOptions options_; // as the knobs are set
  const std::shared_ptr<const gl::Context> context_;
  std::vector<Point3<AcquisitionSpace>> points_;
  uint64_t folderIdentity_ = 0;
  bool isProgressive_ = true;
  render::Description description_;
  std::unique_ptr<FrameRenderer> frames_; // of the context
};

} // namespace surflect::lfm
