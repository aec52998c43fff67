// Queries of sampled surfels at rest: random ones, and those that meet a captured camera and light.
#pragma once

#include "srf/model/model.h"
#include "srf/weights/query.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::verify {

inline constexpr size_t kTriedSurfels = 4000; // at most, evenly spread

// Queries from random directions that face the surfels, under one random light, or none under fixed
// illumination.
weights::QueryBatch randomQueries(const model::Model& model);

// Queries from the camera that sees each surfel best, under one of its captured lights. Surfels that no
// camera sees well are left out.
struct MetQueries {
  weights::QueryBatch batch;
  std::vector<uint32_t> view, column; // one per query: the camera, and the light as a column of its file
};
MetQueries metQueries(const model::Model& model);

} // namespace surflect::verify
