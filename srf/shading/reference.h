// Shading as the paper states it, without acceleration: look-ups are executed one by one, unsorted. The
// specification against which the fast implementation is tested.  [Weyrich 2005, §5.2 and §5.3]
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/operations.h"
#include "srf/shading/query.h"
#include "srf/shading/reflectance_field.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace surflect::shading {

// Radiance (r, g, b) of each query. Directions and look-ups are in double precision, ULR weights in single.
// Throws Error as ViewFile::read.
std::vector<Eigen::Vector3d> shadeReference(const ReflectanceField& field, const QueryBatch& batch,
                                            const ShadeOptions& options, codec::BlockCache& cache);

// Radiance (r, g, b) of each target of given operations, in double precision.
std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const LightRows& rows,
                                              size_t targets, codec::BlockCache& cache);

// Whether a view stores one of the four texels around a place in its picture, in pixels.
bool holdsTexel(codec::BlockCache& cache, uint32_t view, double x, double y);

} // namespace surflect::shading
