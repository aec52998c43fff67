// Shading as the paper states it, without acceleration: weights by loops over all views and lights, look-ups
// one by one in double precision. The specification against which the fast implementation is tested;
// reference frames (render/surfels/reference.h) shade by it, too.  [Weyrich 2005, §5.2 and §5.3]
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/plan.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace surflect::shading {

// The look-ups of all queries, with confidence and alpha, as ShadingPlanner plans them. Directions are in
// double precision, ULR weights in single.
ShadingPlan planReference(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                          const weights::ShadeOptions& options);

// Radiance (r, g, b) of each place of a plan. Throws Error as ViewFile::read.
std::vector<Eigen::Vector3d> shadeReference(const ShadingPlan& plan, codec::BlockCache& cache);

// Radiance (r, g, b) of each target of given operations, in double precision.
std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const weights::LightRows& rows,
                                              size_t targets, codec::BlockCache& cache);

// Whether a view stores one of the four texels around a place in its picture, in pixels.
bool holdsTexel(codec::BlockCache& cache, uint32_t view, double x, double y);

} // namespace surflect::shading
