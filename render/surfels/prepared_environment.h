// Environment maps as the surfel renderer needs them: few directional lights, and a table of the captured
// lights' weights. Where photographs are weighted by pairs, key lights become lights of the scene, with
// moving highlights and shadows. Cameras and lights of the rest are weighted separately.
#pragma once

#include "render/scene/scene.h"
#include "srf/weights/light_weights.h"
#include "surfel/base/time.h"

#include <list>
#include <memory>
#include <optional>
#include <vector>

namespace surflect::surfels {

struct PreparedEnvironment {
  std::vector<weights::EnvironmentLight> lights; // that stand for the map, without key lights
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::fade;
  std::optional<weights::LightTable> table;         // empty if weights::lightTable has none
  std::vector<weights::EnvironmentLight> keyLights; // none unless photographs are weighted by pairs
};

// Replaces the map by enough directional lights to keep the sum of the absolute errors of the captured
// lights' weights below `error` times the sum of the weights. The lights have the spread 0.9 error s^2, where
// s is the spacing of the captured lights in radians, but at most 1. Tests over several rigs and maps find
// sums of 0.27 to 0.9 times `error`. kMaxClusteredLights bounds how small the sum can be. Where photographs
// are weighted by pairs, key lights are kept apart. Where tables answer, lights are never further apart than
// the tables' resolution, whatever the error.
PreparedEnvironment prepareEnvironment(const weights::EnvironmentMap& map, double error,
                                       weights::LightExtrapolation extrapolation,
                                       const weights::ReflectanceField& field,
                                       const weights::ShadeOptions& options, const Progress& progress = {});

// The environment, with at least the given error.
scene::ShotEnvironment coarsened(scene::ShotEnvironment environment, double error);

// Prepared environments of one reflectance field, kept for as long as their maps live.
class EnvironmentCache {
public:
  // Prepares an environment on the first call for its map and settings. The result lives as long as the map.
  // Throws Cancelled.
  const PreparedEnvironment& prepared(const scene::ShotEnvironment& environment,
                                      const weights::ReflectanceField& field,
                                      const weights::ShadeOptions& options, const Progress& progress = {});

private:
  struct Entry {
    std::weak_ptr<const weights::EnvironmentMap> map;
    double error;
    weights::LightExtrapolation extrapolation;
    weights::LightBlend blend;
    bool nearest, weighsPairs, usesTables;
    PreparedEnvironment prepared;
  };
  std::list<Entry> entries_;
};

// A scene and its prepared environments, in the order of its lights.
struct LitScene {
  scene::Scene scene;
  std::vector<const PreparedEnvironment*> environments;
};

// Prepares the environments of a scene, each with an error of at least `leastError`, and appends their key
// lights to its lights. An environment of key lights alone is left out. The result lives as long as the maps.
// Throws Cancelled.
LitScene litScene(const scene::Scene& scene, double leastError, const weights::ReflectanceField& field,
                  const weights::ShadeOptions& options, EnvironmentCache& cache,
                  const Progress& progress = {});

} // namespace surflect::surfels
