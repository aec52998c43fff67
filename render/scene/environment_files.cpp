#include "render/scene/environment_files.h"

#include "surfel/base/hash.h"
#include "surfel/base/stopwatch.h"

namespace surflect::scene {

std::vector<Environment> readEnvironments(const Script& script, const Progress& progress) {
  std::vector<Environment> environments;
  for (size_t i = 0; i < script.lights.size(); ++i) {
    const auto* light = std::get_if<EnvironmentLightMotion>(&script.lights[i]);
    if (!light) continue;
    progress("environment", static_cast<double>(i) / static_cast<double>(script.lights.size()));
    const Stopwatch watch;
    const auto map = std::make_shared<const weights::EnvironmentMap>(
        weights::readEnvironment(light->image, light->mapping, progress));
    static_assert(sizeof(weights::EnvironmentLight) == 7 * sizeof(float)); // no padding to hash
    const uint64_t hash = contentHash(std::as_bytes(std::span(map->texels)));
    environments.push_back({light->image, map, hash, watch.seconds()});
  }
  return environments;
}

} // namespace surflect::scene
