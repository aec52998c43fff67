// Certificate of exactness: how well a model reproduces its own photographs at their cameras and lights.
#pragma once

#include "render/method/renderer.h"
#include "render/verify/check.h"
#include "srf/model/model.h"
#include "srf/weights/query.h"
#include "surfel/base/time.h"

#include <optional>
#include <string>
#include <vector>

namespace surflect::verify {

// A photograph against its rendering, by the protocol of render/evaluation/measure.h, with white at the
// model's white level.
struct ExactPicture {
  std::string camera, light; // identities; no light under fixed illumination
  double psnrLinearDb = 0, psnrSrgbDb = 0, ssim = 0;
  double psnrInteriorDb = 0; // linear, two pixels or more inside of the photographed object
};

struct Exactness {
  std::vector<Check> checks;
  std::vector<ExactPicture> pictures;
  bool isOfCapture = false; // whether photographs are the capture's, not the model's stored ones
};

// Renders up to `count` photographs, spread over cameras and lights, and compares them with the photographs
// of `capture`, or without one with those that the model stores. Surfels are compared with what is stored,
// apart from splatting. Throws Error where photographs cannot be read, and Cancelled.
Exactness exactnessOf(const model::Model& model, method::Renderer& renderer,
                      const weights::ShadeOptions& options, const capture::Capture* capture, size_t count,
                      const Bounds& bounds, const Progress& progress = {});

} // namespace surflect::verify
