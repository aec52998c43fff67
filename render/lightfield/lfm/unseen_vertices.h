// Roots of radiance (root_radiance.h) of vertices whose rings no photograph sees, from the vertices around
// them.
#pragma once

#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Mean root of a vertex over the observed parts of its ring, weighted by the fades of photographs and the hat
// function; 0 if nothing is observed. `rows` are those of the matrix.
Vec3<float> meanRoot(const VertexMatrix& matrix, const RingRows& rows);

// Gives each unseen vertex the mean of those neighbours that are seen, or that got a root in an earlier
// round. Parts of the mesh without a seen vertex stay as they are. roots, isSeen: #positions.
void spreadToUnseen(const Rings& rings, std::span<const uint8_t> isSeen, std::span<Vec3<float>> roots);

// Matrix of a vertex with the same root everywhere, which counts as not observed.
VertexMatrix constantMatrix(const RingRows& rows, size_t cells, const Vec3<float>& root);

} // namespace surflect::lfm
