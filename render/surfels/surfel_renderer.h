// The surfel renderer behind the interface of renderers.
#pragma once

#include "render/renderer.h"
#include "render/surfels/frame.h"
#include "render/surfels/surfel_knobs.h"
#include "srf/model/model.h"

namespace surflect::surfels {

class SurfelRenderer : public render::Renderer {
public:
  // Throws Error as openModel does, and Cancelled.
  SurfelRenderer(const std::filesystem::path& folder, const render::RendererOptions& options,
                 const Progress& progress = {});
  SurfelRenderer(std::shared_ptr<const model::Model> model, const render::RendererOptions& options);

  const render::Description& describe() const override { return description_; }
  std::vector<knobs::Knob> knobs() const override;
  knobs::Setting preview() const override { return previewOf(knobs_); }
  void turn(const knobs::Setting& setting) override;
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                             const Progress& progress, render::FrameLayers memory) override;
  render::EnvironmentReport prepare(const scene::ShotEnvironment& environment,
                                    const Progress& progress) override;

private:
  const std::shared_ptr<const model::Model> model_;
  const FrameOptions full_;
  const std::vector<SurfelKnob> knobs_;
  FrameOptions options_; // full_, with the knobs as they are set
  render::Description description_;
  FrameWorkspace workspace_;
};

// The options as renderFrame takes them, without AOVs.
FrameOptions frameOptions(const render::RendererOptions& options);

// Text of a warning, in one line, if more than half of the surfels are dead or not finite, or if none is
// visible.
std::optional<std::string> emptyFrame(const FrameStats& stats, size_t surfels);

} // namespace surflect::surfels
