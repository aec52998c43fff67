// Queries to a reflectance field: surfel, direction to the viewer, lights. All directions are in acquisition
// space.
#pragma once

#include "srf/ulr/environment_map.h"
#include "srf/ulr/interpolation.h"
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
  Rgb strength{1, 1, 1}; // factor applied to every light
  ulr::LightExtrapolation extrapolation = ulr::LightExtrapolation::fade;
  // If null, ULR weights are computed for every light of the environment.
  const ulr::LightTable* table = nullptr;
};

struct QueryBatch {
  size_t lights = 0;             // per query
  std::vector<uint32_t> surfels; // one per query
  // Surfels that are shaded with the weights of a query, each at its own place in the photographs: those of
  // query q are places[firstPlace[q] .. firstPlace[q + 1]). Both empty: each query shades its own surfel.
  std::vector<uint32_t> places, firstPlace;
  std::vector<Direction3<AcquisitionSpace>> towardsView; // one per query; unit
  // `lights` per query, in succession: unit direction to the light, and irradiance of a surface facing it.
  std::vector<Direction3<AcquisitionSpace>> towardsLight;
  std::vector<Rgb> irradiance;
  // `lights` per query: part of the light that reaches the surfel, 0..1, for a field with
  // lightVisibility; empty: shadow states are not used.
  std::vector<float> reached;
  std::vector<ulr::LightExtrapolation> extrapolation; // one per light of a query; empty: clamp for all
  std::vector<QueryEnvironment> environments;
  // One per query and environment, those of a query in succession: the environment's own rotation, followed
  // by L.
  std::vector<Rotation<AcquisitionSpace, EnvironmentSpace, float>> acquisitionFromEnvironment;

  size_t size() const { return surfels.size(); }
  size_t sources() const { return lights + environments.size(); } // per query

  size_t placeBegin(size_t query) const { return firstPlace.empty() ? query : firstPlace[query]; }
  uint32_t placeAt(size_t i) const { return firstPlace.empty() ? surfels[i] : places[i]; }

  ulr::LightExtrapolation extrapolationOf(size_t light) const {
    return extrapolation.empty() ? ulr::LightExtrapolation::clamp : extrapolation[light];
  }
  const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotationOf(size_t query,
                                                                        size_t environment) const {
    return acquisitionFromEnvironment[query * environments.size() + environment];
  }
};

using ulr::Interpolation;

inline constexpr size_t kTargetsAtOnce = 1 << 14;

struct ShadeOptions {
  // Override the model's choice; see InterpolationChoice.
  std::optional<Interpolation> interpolation = {};
  std::optional<bool> reciprocal = {};
  size_t cameras = 3; // number blended per query, 1..kMaxBlended
  // Number of (camera, light) pairs blended instead, unless weights are separate; default: pairCount.
  std::optional<size_t> pairs = {};
  // Override the model's light blend; see LightBlend.
  std::optional<size_t> lights = {};
  std::optional<ulr::LightFit> lightFit = {};
  std::optional<bool> foreshortened = {};
  // Largest sum of weights that is left out of a blend of cameras, of lights or of pairs
  // (ulr/weight_truncation.h).
  float weightError = 0;
  // Baseline: the nearest camera that sees the surfel, then its nearest light (or the nearest pair), without
  // fading.
  bool nearest = false;
  bool showsBlends = false;  // fills the blend colours of Shaded
  bool usesAlpha = true;     // false: as for a field without alpha
  size_t placesPerQuery = 1; // about as many as in the batch; limits memory, does not affect the radiance
  size_t targetsAtOnce = kTargetsAtOnce; // targets in memory at a time; does not affect the radiance
};

} // namespace surflect::shading
