// Queries to a reflectance field: surfel, direction to the viewer, lights. All directions are in acquisition
// space.
#pragma once

#include "srf/ulr/environment_map.h"
#include "srf/ulr/light_table.h"
#include "srf/ulr/ulr.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::shading {

// An environment that lights all queries of a batch.
struct QueryEnvironment {
  std::span<const ulr::EnvironmentLight> lights;
  Rgb strength{1, 1, 1}; // factor of every light
  ulr::LightExtrapolation extrapolation = ulr::LightExtrapolation::fade;
  const ulr::LightTable* table = nullptr; // null: ULR weights are computed for every light of the environment
};

struct QueryBatch {
  size_t lights = 0;                                     // per query
  std::vector<uint32_t> surfels;                         // one per query
  std::vector<Direction3<AcquisitionSpace>> towardsView; // one per query; unit
  // Row by row, `lights` per query: unit direction to the light, and the irradiance on a surface facing it.
  std::vector<Direction3<AcquisitionSpace>> towardsLight;
  std::vector<Rgb> irradiance;
  std::vector<ulr::LightExtrapolation> extrapolation; // one per light of a query; empty: all extrapolate
  std::vector<QueryEnvironment> environments;
  // Row by row, one per environment: the environment's own rotation, then L.
  std::vector<Rotation<AcquisitionSpace, EnvironmentSpace, float>> acquisitionFromEnvironment;

  size_t size() const { return surfels.size(); }
  size_t sources() const { return lights + environments.size(); } // per query

  ulr::LightExtrapolation uncoveredOf(size_t light) const {
    return extrapolation.empty() ? ulr::LightExtrapolation::clamp : extrapolation[light];
  }
  const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotationOf(size_t query,
                                                                        size_t environment) const {
    return acquisitionFromEnvironment[query * environments.size() + environment];
  }
};

inline constexpr size_t kTargetsAtOnce = 1 << 14;

struct ShadeOptions {
  size_t cameras = 3; // blended per query, 1..kMaxBlended
  size_t pairs = 4;   // (camera, light) pairs blended instead, where the capture is not a full product
  // Replace the model's own light blend; see LightBlend.
  std::optional<size_t> lights = {};
  std::optional<ulr::LightFit> lightFit = {};
  std::optional<bool> foreshortened = {};
  // The baseline: the nearest camera that sees the surfel, then its nearest light (or the nearest pair),
  // without any fading.
  bool nearest = false;
  bool showsBlends = false;              // Shaded has colours of cameras and lights
  size_t targetsAtOnce = kTargetsAtOnce; // targets in memory at a time; the radiance does not depend on it
};

} // namespace surflect::shading
