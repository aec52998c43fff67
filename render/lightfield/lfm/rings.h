// Rings of triangles around the vertices of a mesh, which hold the hat functions of the vertices.
//
// [Chen 2002, §2.1] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Samples of a triangle on a regular barycentric grid, with its corners and edges.
// Sample (i, j), i + j < n, is i steps from corner 0 towards corner 1 and j steps towards corner 2, so that
// an n x n texture holds the samples in one of its halves. Samples are stored row by row, row j = 0 first.
// [Chen 2002, §5.2] Chen et al.: Light Field Mapping, SIGGRAPH.
struct PatchPlace {
  int i = 0, j = 0;
  friend bool operator==(const PatchPlace&, const PatchPlace&) = default;
};

class PatchGrid {
public:
  // Throws Error unless 2 <= samplesPerEdge <= kMostPerEdge.
  explicit PatchGrid(int samplesPerEdge);
  static constexpr int kMostPerEdge = 256;

  int samplesPerEdge() const { return n_; }
  size_t samples() const { return samples(n_); }
  static constexpr size_t samples(int perEdge) { return static_cast<size_t>(perEdge * (perEdge + 1) / 2); }

  size_t index(PatchPlace place) const {
    return static_cast<size_t>(place.j * n_ - place.j * (place.j - 1) / 2 + place.i);
  }
  PatchPlace place(size_t sample) const;
  // Barycentric coordinates in steps: whole numbers that sum to n - 1.
  std::array<int, 3> steps(size_t sample) const;
  // Sample beside one on the edge opposite to a corner, a step nearer to the corner.
  size_t besideFarEdge(size_t sample, size_t corner) const;
  // Barycentric coordinates, which are the hat functions of the triangle's corners  [Chen 2002, §2.1]
  Vec3<double> barycentrics(size_t sample) const;

private:
  int n_;
};

// Least number of samples per edge out of 4, 6, 8, 12, 16, 24 and 32 with at least one sample for each of
// `pixels`, the area of a triangle in its largest view; 32 if none is enough.  [Chen 2002, §5.2, §5.3]
int samplesPerEdgeFor(double pixels);

// A triangle around a vertex, which is its corner 0, 1 or 2.
struct RingTriangle {
  uint32_t triangle = 0;
  uint8_t corner = 0;
  friend bool operator==(const RingTriangle&, const RingTriangle&) = default;
};

// Vertices at one position count as the first of them throughout.
class Rings {
public:
  // Throws Error for a corner beyond the vertices, a triangle with two corners at one position, and a
  // position that is not finite; and Cancelled.
  explicit Rings(const TriangleMesh& mesh, const Progress& progress = {});

  // Vertices with triangles, so ordered that those near each other on the mesh are near in the list.
  std::span<const uint32_t> vertices() const { return vertices_; }
  // Vertices of each triangle (#triangles).
  std::span<const std::array<uint32_t, 3>> corners() const { return corners_; }
  // Triangles around a vertex, in rising order.
  std::span<const RingTriangle> around(uint32_t vertex) const {
    return std::span(triangles_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }
  // Frame along the area-weighted mean of the normals around a vertex. Where these cancel it is along the
  // first normal that is not 0; and along +z if all are.
  const VertexFrame& frame(uint32_t vertex) const { return frames_[vertex]; }

private:
  std::vector<std::array<uint32_t, 3>> corners_;
  std::vector<size_t> first_; // #positions + 1
  std::vector<RingTriangle> triangles_;
  std::vector<VertexFrame> frames_; // #positions
  std::vector<uint32_t> vertices_;
};

// Distinct surface points of a ring with a hat function above 0: the rows of a vertex's matrix. Samples on an
// edge that triangles share are one row, so that any approximation is continuous across the edge.
struct RingRows {
  static constexpr uint32_t kNone = UINT32_MAX;

  // A sample of a triangle of the ring: an index into Rings::around(), and one of the grid.
  struct Sample {
    uint32_t ringTriangle = 0, sample = 0;
  };

  std::vector<uint32_t> rowOf; // #ring triangles x #samples; kNone where the hat function is 0
  std::vector<float> hats;     // #rows; above 0
  std::vector<size_t> first;   // #rows + 1
  std::vector<Sample> samples; // of each row, ring triangles in rising order

  size_t rows() const { return hats.size(); }
  std::span<const Sample> of(size_t row) const {
    return std::span(samples).subspan(first[row], first[row + 1] - first[row]);
  }
};

RingRows ringRows(const Rings& rings, uint32_t vertex, const PatchGrid& grid);

} // namespace surflect::lfm
