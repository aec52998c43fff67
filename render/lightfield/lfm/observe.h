// Observations of a surface point, as a function that tests can replace by a closed form.
#pragma once

#include "render/lightfield/common/sight.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace surflect::lfm {

using lightfield::Observation;

// Returns the photographs that see a point of a triangle, in rising order. Called from several threads.
using Observe =
    std::function<std::vector<Observation>(uint32_t triangle, const Point3<AcquisitionSpace, double>& point)>;

// Observations in photographs. Arguments must outlive the function; a triangle without an area is not seen.
Observe observeIn(const lightfield::Sight& sight, const TriangleMesh& mesh, const SmoothNormals& normals);

} // namespace surflect::lfm
