// Vertex light field matrices: square roots of the radiance around a vertex, at a grid of surface points and
// in the directions of its photographs, times the hat function of the vertex (rings.h).
//
// The paper resamples each row to a grid of directions. Here a row has one number for each photograph that
// sees the ring, a *site* of the disc, and all rows of a vertex share the blends by which cells of the grid
// are made of sites. Matrices are as many times smaller as there are fewer photographs than cells, and the
// factors of cells are the same blends of those of sites.
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

// F[row, site, channel] = hat(row) f(row, site, channel)  [Chen 2002, Eqs. 2, 4], where f is the square root
// of the radiance (root_radiance.h). In a cell of the grid of directions, F is the blend of its sites.
struct VertexMatrix {
  size_t rows = 0, sites = 0;
  std::vector<float> values; // rows x sites x 3
  // rows x sites: how well a value was observed, 0..1. It is 0 at sites beyond the hull of the photographs
  // that see the row, and in rows that no photograph sees; values there are extrapolated.
  std::vector<float> weights;
  std::vector<CellBlend> cells; // of sites
  // Share of the grid that a site stands for, 0..1, the largest 1: its weights in the blends of all cells.
  // Cells outside the disc or beyond the hull of the sites count by kLeastWeight.
  std::vector<float> siteWeights;
  // Number of rows that no photograph sees, which are filled from the rows around them. If no row is seen,
  // there is no site.
  size_t unseenRows = 0;
  // Photographs that see every sample of a triangle, summed over the triangles whose corner 0 is this vertex:
  // the sum over all vertices counts each triangle once.
  size_t triangleViews = 0;

  float& value(size_t row, size_t site, size_t channel) { return values[3 * (row * sites + site) + channel]; }
  float value(size_t row, size_t site, size_t channel) const {
    return values[3 * (row * sites + site) + channel];
  }
};

// Weight of extrapolated values, which hold factors where few samples were observed. Without it, extrapolated
// directions show as black or bright blots.
inline constexpr float kLeastWeight = 0.02f;

// Values in the cells of the grid [cells][channels], as blends of values at sites [sites][channels].
std::vector<float> inCells(std::span<const CellBlend> cells, std::span<const float> ofSites, size_t channels);

// Matrix of a vertex that has triangles, which `patches` holds; its rows are those of ringRows(). Memory: 16
// bytes for each row and site. May be called from several threads. Throws Cancelled.
VertexMatrix matrixOf(const SeenLightField& field, const Patches& patches, uint32_t vertex,
                      const Progress& progress = {});
// Matrix of a single vertex, with patches of its own.
VertexMatrix matrixOf(const SeenLightField& field, uint32_t vertex);

// Sizes that a builder was asked for.
struct MapSizes {
  int samples = 0, viewSize = 0; // along an edge of a triangle, and of the grid of directions
  size_t terms = 0, channels = 3;
  size_t columns = 0; // of a matrix, at most; 0: as many as cells of the grid
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

// Matrix of a vertex with the same root everywhere, at one site, which counts as not observed.
VertexMatrix constantMatrix(const RingRows& rows, size_t cells, const Vec3<float>& root);

} // namespace surflect::lfm
