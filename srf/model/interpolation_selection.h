// Selects how photographs are weighted, by leave-one-out cross-validation: photographs are predicted by a
// model that lacks their camera, their light, or both. No assumption about the material is needed.
#pragma once

#include "srf/model/model.h"
#include "srf/weights/interpolation.h"
#include "surfel/base/progress.h"

#include <optional>

namespace surflect::model {

struct InterpolationSelection {
  weights::InterpolationChoice choice;
  bool foreshortened = false; // whether blends of pairs are foreshortened
  // Error of the predicted photographs, as the mean of the PSNR in linear light and after the sRGB curve:
  // with the choice, and with separate weights. Empty if there are too few cameras or lights.
  struct LeftOut {
    double chosenDb = 0, separateDb = 0;
  };
  std::optional<LeftOut> leftOut;
};

// Chooses among separate weights, and kriging with several scales, with and without reciprocity and shadow
// states. Separate weights stay unless kriging gains 1 dB among all photographs left out, and 1 dB among
// those whose camera stays: leaving a camera out doubles the gap to the next, and in gaps kriging gains even
// for glass, where it loses otherwise. The best settings of kriging are stored even then. Blends of pairs are
// foreshortened if the model's light blend is; in a capture with gaps, which has no light blend, if there are
// normals and the error is less. Reads blocks of the model's view files. Throws Error as ViewFile::read, and
// Cancelled.
InterpolationSelection selectInterpolation(const Model& model, bool hasNormals,
                                           const Progress& progress = {});

} // namespace surflect::model
