// Samples of a triangle on a regular barycentric grid, with its corners and edges.
//
// Sample (i, j), i + j < n, is i steps from corner 0 towards corner 1 and j steps towards corner 2, so that
// an n x n texture holds the samples in one of its halves. Samples are stored row by row, row j = 0 first.
// [Chen 2002, §5.2] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstddef>

namespace surflect::lfm {

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

} // namespace surflect::lfm
