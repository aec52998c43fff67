#include "render/surfels/prepared_environment.h"

#include <algorithm>

namespace surflect::surfels {

PreparedEnvironment prepareEnvironment(const ulr::EnvironmentMap& map, double error,
                                       ulr::LightExtrapolation extrapolation,
                                       const shading::ReflectanceField& field,
                                       const shading::ShadeOptions& options, const Progress& progress) {
  const double spacing = std::min(1.0, shading::lightSpacing(field));
  return {ulr::clusteredLights(map.texels, 0.9 * error * spacing * spacing, progress), extrapolation,
          shading::lightTable(field, options, extrapolation)};
}

scene::ShotEnvironment coarsened(scene::ShotEnvironment environment, double error) {
  environment.error = std::max(environment.error, error);
  return environment;
}

const PreparedEnvironment& EnvironmentCache::prepared(const scene::ShotEnvironment& environment,
                                                      const shading::ReflectanceField& field,
                                                      const shading::ShadeOptions& options,
                                                      const Progress& progress) {
  const ulr::LightBlend blend = shading::lightBlend(field, options);
  for (const Entry& entry : entries_)
    if (entry.map.lock() == environment.map && entry.error == environment.error &&
        entry.extrapolation == environment.extrapolation && entry.blend == blend &&
        entry.nearest == options.nearest)
      return entry.prepared;
  std::erase_if(entries_, [](const Entry& entry) { return entry.map.expired(); });
  entries_.push_back({environment.map, environment.error, environment.extrapolation, blend, options.nearest,
                      prepareEnvironment(*environment.map, environment.error, environment.extrapolation,
                                         field, options, progress)});
  return entries_.back().prepared;
}

} // namespace surflect::surfels
