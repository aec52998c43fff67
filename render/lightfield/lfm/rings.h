// Rings of triangles around the vertices of a mesh, which hold the hat functions of the vertices.
//
// [Chen 2002, §2.1] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/patch_grid.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

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
