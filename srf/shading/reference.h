// Shading as the paper states it: plainly, one look-up for one surfel, camera and light after another,
// unsorted. Slow; the specification that the fast forms are tested against.  [Weyrich 2005, §5.2 and §5.3]
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/operations.h"
#include "srf/shading/query.h"
#include "srf/shading/reflectance_field.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace surflect::shading {

// Radiance per query: r, g, b. Directions and look-ups are in double precision, the weights of ULR in single.
// Throws Error as ViewFile::read.
std::vector<Eigen::Vector3d> shadeReference(const ReflectanceField& field, const QueryBatch& batch,
                                            const ShadeOptions& options, codec::BlockCache& cache);

// Radiance per target of operations that are given: r, g, b, in double precision.
std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const LightRows& rows,
                                              size_t targets, codec::BlockCache& cache);

} // namespace surflect::shading
