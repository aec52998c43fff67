// Vertex light field matrices: square roots of the radiance around a vertex, resampled to a grid of surface
// points and a grid of viewing directions (direction_disc.h), times the hat function of the vertex (rings.h).
//
// [Chen 2002, §2.1, §2.2, §5.2] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "render/lightfield/lfm/patches.h"
#include "render/lightfield/lfm/rings.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// F[row, cell, channel] = hat(row) f(row, cell, channel)  [Chen 2002, Eqs. 2, 4], where f is the square root
// of the radiance (root_radiance.h)
struct VertexMatrix {
  size_t rows = 0, cells = 0;
  std::vector<float> values; // rows x cells x 3
  // rows x cells: how well a value was observed, 0..1. It is 0 for cells outside the disc or beyond the hull
  // of the photographs' directions, and in rows that no photograph sees; values there are extrapolated.
  std::vector<float> weights;
  // Number of rows that no photograph sees, which are filled from the rows around them. If no row is seen,
  // values are 0.
  size_t unseenRows = 0;
  // Photographs that see every sample of a triangle, summed over the triangles whose corner 0 is this vertex:
  // the sum over all vertices counts each triangle once.
  size_t triangleViews = 0;

  float& value(size_t row, size_t cell, size_t channel) { return values[3 * (row * cells + cell) + channel]; }
  float value(size_t row, size_t cell, size_t channel) const {
    return values[3 * (row * cells + cell) + channel];
  }
};

// Matrix of a vertex that has triangles, which `patches` holds; its rows are those of ringRows(). Memory: 16
// bytes for each row and cell. May be called from several threads. Throws Cancelled.
VertexMatrix matrixOf(const SeenLightField& field, const Patches& patches, uint32_t vertex,
                      const Progress& progress = {});
// Matrix of a single vertex, with patches of its own.
VertexMatrix matrixOf(const SeenLightField& field, uint32_t vertex);

// Sizes that a builder was asked for.
struct MapSizes {
  int samples = 0, viewSize = 0; // along an edge of a triangle, and of the grid of directions
  size_t terms = 0, channels = 3;
};

// Most terms that the matrix of a vertex can have: samples around it, or directions, if these are fewer.
size_t mostTerms(const Rings& rings, const MapSizes& sizes);

// Bytes of matrices and maps of these sizes in memory, at most.
double memoryFor(const Rings& rings, const MapSizes& sizes);
// Throws Error if that is more than this process may use.
void requireMemoryFor(const Rings& rings, const MapSizes& sizes);

// Bytes of all matrices as the paper counts them: one for each channel of each sample of each triangle in
// each cell.  [Chen 2002, §6.1, Table 1]
uint64_t resampledBytes(size_t triangles, size_t samples, size_t cells, size_t channels = 3);
// Bytes of the triangles in the photographs that see them, which are resampled to one size: three for each
// sample. `triangleViews` is summed over all vertices.  [Chen 2002, §6.1, Table 1: raw image size]
uint64_t normalizedBytes(size_t triangleViews, size_t samples);

// Roots of radiance (root_radiance.h) of vertices whose rings no photograph sees, from the vertices around
// them.

// Mean root of a vertex over the observed parts of its ring, weighted by the fades of photographs and the hat
// function; 0 if nothing is observed. `rows` are those of the matrix.
Vec3<float> meanRoot(const VertexMatrix& matrix, const RingRows& rows);

// Gives each unseen vertex the mean of those neighbours that are seen, or that got a root in an earlier
// round. Parts of the mesh without a seen vertex stay as they are. roots, isSeen: #positions.
void spreadToUnseen(const Rings& rings, std::span<const uint8_t> isSeen, std::span<Vec3<float>> roots);

// Matrix of a vertex with the same root everywhere, which counts as not observed.
VertexMatrix constantMatrix(const RingRows& rows, size_t cells, const Vec3<float>& root);

} // namespace surflect::lfm
