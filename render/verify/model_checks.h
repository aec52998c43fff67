// Checks of a model at rest: laws of look-up and weights, coverage and gaps of its rig, precision.
#pragma once

#include "render/verify/check.h"
#include "srf/model/model.h"
#include "srf/shading/plan.h"
#include "srf/weights/query.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::verify {

// Queries of sampled surfels at rest: random ones, and those that meet a captured camera and light.
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
MetQueries metQueries(const model::Model& model, const weights::ShadeOptions& options);

// Laws are tried at thousands of surfels, with random warps, views and lights from a fixed seed; coverage and
// precision at all surfels. Throws Cancelled.
std::vector<Check> modelChecks(const model::Model& model, weights::ShadeOptions options, const Bounds& bounds,
                               const Progress& progress = {});

// Largest angle, in radians, at which a source still counts as near: the spacing of these directions, clamped
// to 10..45 degrees.
double nearAngle(std::span<const Direction3<AcquisitionSpace, double>> directions);

// Unit directions from the middle of a model to its cameras.
std::vector<Direction3<AcquisitionSpace, double>> viewDirections(const model::Model& model);

// Angle of two unit directions, radians.
double angleBetween(const Vec3<double>& a, const Vec3<double>& b);

// Sums of the weights of a plan's operations (#targets).
std::vector<double> weightSums(const shading::ShadingPlan& plan);

// Largest distance from 1 of these sums at one place. Targets of environments are left out where pairs are
// weighted, as their light may fade. Targets of tables, and lights that tables answer alone, are left out,
// too.
double weightError(const shading::ShadingPlan& plan, std::span<const double> sums, size_t place,
                   size_t lights);

// A place at rest.
FlaggedPlace placeOf(const model::Model& model, uint32_t surfel, double figure);

} // namespace surflect::verify
