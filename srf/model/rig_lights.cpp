#include "srf/model/rig_lights.h"

namespace surflect {

std::vector<Source> sourcesOf(std::span<const Light> lights) {
  std::vector<Source> sources;
  for (const Light& light : lights) {
    const auto* point = std::get_if<PointLight>(&light.kind);
    sources.push_back({point ? point->position.raw() : towardsLight(light, {}).raw(), !point});
  }
  return sources;
}

} // namespace surflect
