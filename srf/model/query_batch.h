// What srf/ is asked: directions in acquisition space go in.
#pragma once

#include "srf/ulr/environment.h"
#include "srf/ulr/light_table.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::model {

// An environment that lights all queries of a batch.
struct QueryEnvironment {
  std::span<const ulr::EnvironmentLight> lights;
  Rgb strength{1, 1, 1}; // of them all
  ulr::LightExtrapolation extrapolation = ulr::LightExtrapolation::fade;
  const ulr::LightTable* table =
      nullptr; // see lightTable; without it every light is answered by ULR of its own
};

// What is asked of a model, as arrays; everything in acquisition space.
struct QueryBatch {
  size_t lights = 0;                                     // per query
  std::vector<uint32_t> surfels;                         // one per query
  std::vector<Direction3<AcquisitionSpace>> towardsView; // one per query; unit
  // Row by row, `lights` per query: unit direction to the light, and the irradiance on a surface facing it.
  std::vector<Direction3<AcquisitionSpace>> towardsLight;
  std::vector<Rgb> irradiance;
  std::vector<ulr::LightExtrapolation> extrapolation; // one per light of a query; none: they extrapolate
  std::vector<QueryEnvironment> environments;
  // Row by row, one per environment: L after the environment's own place in the world.
  std::vector<Rotation<AcquisitionSpace, EnvironmentSpace, float>> acquisitionFromEnvironment;

  size_t size() const { return surfels.size(); }
  size_t targets() const { return lights + environments.size(); } // of light, per query

  ulr::LightExtrapolation uncoveredOf(size_t light) const {
    return extrapolation.empty() ? ulr::LightExtrapolation::clamp : extrapolation[light];
  }
  const Rotation<AcquisitionSpace, EnvironmentSpace, float>& turnOf(size_t query, size_t environment) const {
    return acquisitionFromEnvironment[query * environments.size() + environment];
  }
};

} // namespace surflect::model
