#include "render/scene/environment.h"

#include "surfel/base/hash.h"
#include "surfel/base/stopwatch.h"

#include <algorithm>

namespace surflect::scene {

PreparedEnvironment prepareEnvironment(const ulr::EnvironmentMap& map, double error,
                                       ulr::LightExtrapolation extrapolation, const model::Model& model,
                                       const shading::ShadeOptions& options, const Progress& progress) {
  PreparedEnvironment prepared;
  prepared.texels = map.texels.size();
  prepared.replaced = map.replaced;
  prepared.clamped = map.clamped;
  const double spacing = std::min(1.0, shading::lightSpacing(model));
  prepared.lights = ulr::gathered(map.texels, 0.9 * error * spacing * spacing, progress);
  prepared.extrapolation = extrapolation;
  prepared.table = shading::lightTable(model, options, extrapolation);
  static_assert(sizeof(ulr::EnvironmentLight) == 6 * sizeof(float)); // no padding to hash
  prepared.hash = contentHash(std::as_bytes(std::span(prepared.lights)));
  return prepared;
}

std::vector<PreparedEnvironment> prepareEnvironments(const Script& script, const model::Model& model,
                                                     const shading::ShadeOptions& options,
                                                     const Progress& progress) {
  std::vector<PreparedEnvironment> environments;
  for (size_t i = 0; i < script.lights.size(); ++i) {
    const auto* light = std::get_if<EnvironmentLightMotion>(&script.lights[i]);
    if (!light) continue;
    progress("environment", static_cast<double>(i) / static_cast<double>(script.lights.size()));
    const Stopwatch watch;
    const ulr::EnvironmentMap map = ulr::readEnvironment(light->image, light->mapping, progress);
    auto& prepared = environments.emplace_back(
        prepareEnvironment(map, light->error, light->extrapolation, model, options, progress));
    prepared.image = light->image;
    prepared.seconds = watch.seconds();
  }
  return environments;
}

} // namespace surflect::scene
