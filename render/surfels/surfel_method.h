// Surface reflectance fields as a method: their options, and their renderer.  [Weyrich 2005]
#pragma once

#include "render/method/method.h"
#include "render/surfels/frame.h"
#include "srf/model/model.h"
#include "srf/model/pack.h"

namespace surflect::surfels {

const method::Method& surfelMethod();

class SurfelRenderer : public method::Renderer {
public:
  // Throws Error for a setting that frames of surfels cannot have.
  SurfelRenderer(std::shared_ptr<const model::Model> model, const method::Setting& setting = {});

  const method::Description& describe() const override { return description_; }
  std::span<const method::Option> options() const override { return rows_; }
  method::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, method::FrameLayers memory = {}) override;
  method::PhotographBlend blendedAt(const scene::Scene& scene, capture::Pixel pixel,
                                    const Progress& progress = {}) override;
  method::EnvironmentReport prepare(const scene::ShotEnvironment& environment,
                                    const Progress& progress = {}) override;

private:
  void configure(const method::Setting& setting) override;

  const std::shared_ptr<const model::Model> model_;
  std::vector<method::Option> rows_;
  FrameOptions options_;
  std::vector<Point3<AcquisitionSpace>> points_; // on the object, of a model with a pixel grid
  method::Description description_;
  FrameWorkspace workspace_;
};

// A setting of a build as model::pack() takes it.
model::PackOptions packOptions(const method::Setting& setting);

// A setting as renderFrame() takes it, without AOVs.
FrameOptions frameOptions(const method::Setting& setting);

// Text of a warning, in one line, if more than half of the surfels are dead or not finite, or if none is
// visible.
std::optional<std::string> emptyFrame(const FrameStats& stats, size_t surfels);

} // namespace surflect::surfels
