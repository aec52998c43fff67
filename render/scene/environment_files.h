// The environments of a script: their pixels, read once for all frames of a shot.
#pragma once

#include "render/scene/script.h"
#include "surfel/base/progress.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace surflect::scene {

struct Environment {
  std::filesystem::path image;
  std::shared_ptr<const weights::EnvironmentMap> map; // never null
  uint64_t hash = 0;                                  // of the texels
  double seconds = 0;                                 // taken by reading
};

// One per environment of the script, in order. Throws Error and Cancelled as readEnvironment does.
std::vector<Environment> readEnvironments(const Script& script, const Progress& progress);

} // namespace surflect::scene
