#include "render/surfels/prepared_environment.h"

#include <algorithm>

namespace surflect::surfels {

namespace {

// Largest spread of lights that tables answer, in square radians: about the angle between two nodes of a
// table (reflectance_table.h). They see each light as a dot: further apart, the dots of a smooth map show.
constexpr double kSpreadOfTables = 0.04 * 0.04;

} // namespace

PreparedEnvironment prepareEnvironment(const weights::EnvironmentMap& map, double error,
                                       weights::LightExtrapolation extrapolation,
                                       const weights::ReflectanceField& field,
                                       const weights::ShadeOptions& options, const Progress& progress) {
  const double spacing = std::min(1.0, weights::lightSpacing(field));
  std::vector<weights::EnvironmentLight> texels; // a large map takes a while to copy
  texels.reserve(map.lights.size());
  for (size_t i = 0; i < map.lights.size(); ++i) {
    progress.checkNowAndThen(i);
    texels.push_back(map.lights[i]);
  }
  double spread = 0.9 * error * spacing * spacing;
  if (weights::usesTables(field, options)) spread = std::min(spread, kSpreadOfTables);
  PreparedEnvironment prepared{weights::clusteredLights(std::move(texels), spread, progress),
                               extrapolation,
                               weights::lightTable(field, options, extrapolation),
                               {}};
  if (weights::usesKriging(field, options)) {
    const auto others =
        prepared.lights.begin() + static_cast<ptrdiff_t>(weights::moveKeyLightsFirst(prepared.lights));
    prepared.keyLights.assign(prepared.lights.begin(), others);
    prepared.lights.erase(prepared.lights.begin(), others);
  }
  return prepared;
}

scene::ShotEnvironment coarsened(scene::ShotEnvironment environment, double error) {
  environment.error = std::max(environment.error, error);
  return environment;
}

const PreparedEnvironment& EnvironmentCache::prepared(const scene::ShotEnvironment& environment,
                                                      const weights::ReflectanceField& field,
                                                      const weights::ShadeOptions& options,
                                                      const Progress& progress) {
  const weights::LightBlend blend = weights::lightBlend(field, options);
  const bool weighsPairs = weights::usesKriging(field, options),
             usesTables = weights::usesTables(field, options);
  for (const Entry& entry : entries_)
    if (entry.map.lock() == environment.map && entry.error == environment.error &&
        entry.extrapolation == environment.extrapolation && entry.blend == blend &&
        entry.nearest == options.nearest && entry.weighsPairs == weighsPairs &&
        entry.usesTables == usesTables)
      return entry.prepared;
  std::erase_if(entries_, [](const Entry& entry) { return entry.map.expired(); });
  entries_.push_back({environment.map, environment.error, environment.extrapolation, blend, options.nearest,
                      weighsPairs, usesTables,
                      prepareEnvironment(*environment.map, environment.error, environment.extrapolation,
                                         field, options, progress)});
  return entries_.back().prepared;
}

LitScene litScene(const scene::Scene& scene, double leastError, const weights::ReflectanceField& field,
                  const weights::ShadeOptions& options, EnvironmentCache& cache, const Progress& progress) {
  LitScene lit{scene, {}};
  lit.scene.lights.clear();
  std::vector<scene::ShotLight> keyLights;
  for (const scene::ShotLight& light : scene.lights) {
    if (const auto* environment = std::get_if<scene::ShotEnvironment>(&light)) {
      const PreparedEnvironment& prepared =
          cache.prepared(coarsened(*environment, leastError), field, options, progress);
      for (const weights::EnvironmentLight& key : prepared.keyLights)
        keyLights.push_back(
            scene::ShotDirectionalLight{environment->objectFromEnvironment(key.towards.cast<double>()),
                                        environment->strength * key.irradiance, environment->extrapolation});
      if (prepared.lights.empty() && !prepared.keyLights.empty()) continue;
      lit.environments.push_back(&prepared);
    }
    lit.scene.lights.push_back(light);
  }
  lit.scene.lights.insert(lit.scene.lights.end(), keyLights.begin(), keyLights.end());
  return lit;
}

} // namespace surflect::surfels
