// Checks of a model at rest: laws of look-up and weights, coverage and gaps of its rig, precision.
#pragma once

#include "render/verify/check.h"
#include "srf/model/model.h"
#include "srf/weights/query.h"
#include "surfel/base/progress.h"

#include <vector>

namespace surflect::verify {

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

// Largest distance from 1 of `sums`, for each target of a plan the sum of its operations' weights. Targets of
// environments are left out where pairs are weighted, as their light may fade.
double weightError(const weights::QueryBatch& batch, const std::vector<double>& sums, size_t targetsPerPlace);

// A place at rest.
FlaggedPlace placeOf(const model::Model& model, uint32_t surfel, double figure);

} // namespace surflect::verify
