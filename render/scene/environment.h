// The environments of a script, made ready once for all frames of a shot.
#pragma once

#include "render/scene/script.h"
#include "srf/model/model.h"
#include "srf/shading/shade.h"
#include "surfel/base/progress.h"

#include <optional>
#include <vector>

namespace surflect::scene {

struct PreparedEnvironment {
  std::filesystem::path image;
  size_t texels = 0;                         // that shine
  size_t replaced = 0, clamped = 0;          // see EnvironmentMap
  std::vector<ulr::EnvironmentLight> lights; // they stand for the picture
  ulr::LightExtrapolation extrapolation = ulr::LightExtrapolation::fade;
  std::optional<ulr::LightTable> table; // where lightTable has one
  uint64_t hash = 0;                    // of the lights
  double seconds = 0;                   // it took
};

// One per environment of the script, in order. Throws Error and Cancelled as readEnvironment does.
std::vector<PreparedEnvironment> prepareEnvironments(const Script& script, const model::Model& model,
                                                     const shading::ShadeOptions& options,
                                                     const Progress& progress);

// From texels that are at hand. As many lights stand for them as keep the weights of captured lights within
// `error` of the whole: their spread is error s^2, s the spacing of the captured lights in radians but at
// most 1. Measured over rigs of 28, 60 and 200 lights, a constant and a lively map and errors of 0.01 to 0.1,
// the absolute errors of weights sum to 0.4 to 1 of `error`. kMostGathered bounds how small it can be.
PreparedEnvironment prepareEnvironment(const ulr::EnvironmentMap& map, double error,
                                       ulr::LightExtrapolation extrapolation, const model::Model& model,
                                       const shading::ShadeOptions& options, const Progress& progress = {});

} // namespace surflect::scene
