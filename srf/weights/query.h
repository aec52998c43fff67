// Queries to a reflectance field: surfel, direction to the viewer, lights. All directions are in acquisition
// space.
#pragma once

#include "srf/weights/environment_map.h"
#include "srf/weights/interpolation.h"
#include "srf/weights/light_table.h"
#include "srf/weights/nearest_kernels.h"
#include "surfel/cloud.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::weights {

// An environment that lights all queries of a batch.
struct QueryEnvironment {
  std::span<const EnvironmentLight> lights;
  Rgb strength{1, 1, 1}; // factor applied to every light
  LightExtrapolation extrapolation = LightExtrapolation::fade;
  // If null, ULR weights are computed for every light of the environment.
  const LightTable* table = nullptr;
};

// A value at each of the four corners of a patch of surfels.
template <class T> using AtCorners = std::array<T, 4>;

struct QueryBatch {
  size_t lights = 0;             // per query
  std::vector<uint32_t> surfels; // one per query
  // Surfels that are shaded with the weights of a query, each at its own place in the photographs: those of
  // query q are places[firstPlace[q] .. firstPlace[q + 1]). Both empty: each query shades its own surfel.
  std::vector<uint32_t> places, firstPlace;
  // If not empty, queries come in groups of four, the corners of a patch; firstPlace has an entry a group,
  // and each place is shaded with the mean of its corners' weights, weighted by its entry here, whose sum
  // is 1. For kriging and tables, without environments.
  std::vector<AtCorners<float>> cornerWeights;
  std::vector<Direction3<AcquisitionSpace>> towardsView; // one per query; unit
  // `lights` per query, in succession: unit direction to the light, and irradiance of a surface facing it.
  std::vector<Direction3<AcquisitionSpace>> towardsLight;
  std::vector<Rgb> irradiance;
  // `lights` per query: part of the light that reaches the surfel, 0..1, for a field with
  // lightVisibility; empty: shadow states are not used.
  std::vector<float> reached;
  std::vector<LightExtrapolation> extrapolation; // one per light of a query; empty: clamp for all
  std::vector<QueryEnvironment> environments;
  // One per query and environment, those of a query in succession: the environment's own rotation, followed
  // by L.
  std::vector<Rotation<AcquisitionSpace, EnvironmentSpace, float>> acquisitionFromEnvironment;

  size_t size() const { return surfels.size(); }
  size_t sources() const { return lights + environments.size(); } // per query

  size_t corners() const { return cornerWeights.empty() ? 1 : 4; } // queries a group
  // First place of a group, by its first query.
  size_t placeBegin(size_t query) const { return firstPlace.empty() ? query : firstPlace[query / corners()]; }
  uint32_t placeAt(size_t i) const { return firstPlace.empty() ? surfels[i] : places[i]; }

  // Places at rest of the queries [begin, begin + count), 1..kQueryLanes of them.
  std::array<Point3<AcquisitionSpace>, kQueryLanes> placesAt(const SurfelCloud& cloud, size_t begin,
                                                             size_t count) const {
    std::array<Point3<AcquisitionSpace>, kQueryLanes> all;
    for (size_t lane = 0; lane < count; ++lane) all[lane] = cloud.p0[surfels[begin + lane]];
    return all;
  }
  // Their directions to the l-th light.
  std::array<Direction3<AcquisitionSpace>, kQueryLanes> towardsLightAt(size_t l, size_t begin,
                                                                       size_t count) const {
    std::array<Direction3<AcquisitionSpace>, kQueryLanes> all;
    for (size_t lane = 0; lane < count; ++lane) all[lane] = towardsLight[(begin + lane) * lights + l];
    return all;
  }

  LightExtrapolation extrapolationOf(size_t light) const {
    return extrapolation.empty() ? LightExtrapolation::clamp : extrapolation[light];
  }
  const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotationOf(size_t query,
                                                                        size_t environment) const {
    return acquisitionFromEnvironment[query * environments.size() + environment];
  }
};

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
  std::optional<LightFit> lightFit = {};
  std::optional<bool> foreshortened = {};
  // Largest sum of weights that is left out of a blend of cameras, of lights or of pairs (ulr.h).
  float weightError = 0;
  // Baseline: the nearest camera that sees the surfel, then its nearest light (or the nearest pair), without
  // fading.
  bool nearest = false;
  bool showsBlends = false;  // fills the blend colours of Shaded
  bool showsTargets = false; // fills the targets of Shaded
  bool usesAlpha = true;     // false: as for a field without alpha
  size_t placesPerQuery = 1; // about as many as in the batch; limits memory, does not affect the radiance
  size_t targetsAtOnce = kTargetsAtOnce; // targets in memory at a time; does not affect the radiance

  friend bool operator==(const ShadeOptions&, const ShadeOptions&) = default;
};

} // namespace surflect::weights
