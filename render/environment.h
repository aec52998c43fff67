// The environments of a script, made ready once for all frames of a shot.
#pragma once

#include "render/script.h"
#include "srf/model/shade.h"
#include "surfel/progress.h"

#include <optional>
#include <vector>

namespace surflect {

struct PreparedEnvironment {
  std::filesystem::path image;
  size_t texels = 0, replaced = 0;      // that shine; that were negative or not finite
  std::vector<EnvironmentLight> lights; // they stand for the picture
  Uncovered uncovered = Uncovered::fade;
  std::optional<LightTable> table; // where lightTable has one
  uint64_t hash = 0;               // of the lights
  double seconds = 0;              // it took
};

// One per environment of the script, in order. Where the script does not say how many lights stand for a
// picture there are 256, or 4 per captured light if that is more. Throws Error as readEnvironment does.
std::vector<PreparedEnvironment> prepareEnvironments(const Script& script, const Model& model,
                                                     const ShadeOptions& options, const Progress& progress);

// From texels that are at hand.
PreparedEnvironment prepareEnvironment(const EnvironmentMap& map, size_t samples, Uncovered uncovered,
                                       const Model& model, const ShadeOptions& options);

} // namespace surflect
