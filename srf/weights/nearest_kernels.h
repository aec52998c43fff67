// Vectorised loops of nearest_sources.h and light_table.h. A lane is a query, or a direction; an array of
// lanes has kQueryLanes floats, and a vector in lanes three such arrays in succession.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surflect::weights {

constexpr size_t kQueryLanes = 16;
constexpr size_t kMaxNearest = 17; // kMaxBlended, and the one that sets the threshold

// A Source (nearest_sources.h) with each double split into a sum of two floats.
struct SplitSource {
  float x, y, z, restX, restY, restZ;
  bool isDistant;
};

// Sources of smallest penalty for each lane, ascending; ties keep the order of candidates. The penalty is
// infinite if there are fewer sources.
struct NearestOfQueries {
  float penalty[kMaxNearest][kQueryLanes], index[kMaxNearest][kQueryLanes];
};

// A cone of directions from `place`: unit vectors whose scalar product with `towards` is at least `least`.
struct SourceCone {
  float place[3];
  float towards[3];
  float least;
};

// Writes unit directions from 16 places to sources[which[c]] (or sources[c] if `which` is null) at towards +
// 48 c. Returns a bit for each lane in which a direction is lost: the source is nearer than 1e-15 or farther
// than 1e15.
uint32_t writeDirections(const SplitSource* sources, const uint32_t* which, size_t count, const float* places,
                         float* towards);

// Writes the largest penalty of each lane, as in findNearest, over the candidates `which`; infinite if a
// penalty is NaN.
void writeLargestPenalties(const float* candidates, const uint32_t* which, size_t count, const float* towards,
                           float* penalties);

// Finds the `slots` nearest of `count` candidates, sources[which[c]] or sources[c] as above, with unit
// directions at candidates + 48 c. The penalty is |a - b|^2 / 2 times inverseFades[16 c] of the lane; that
// factor is 1 if `inverseFades` is null, and infinite for a candidate that is left out. Penalties above
// `limits` do not count. slots: 1..kMaxNearest; more may be written.
void findNearest(const float* candidates, const uint32_t* which, const float* inverseFades, size_t count,
                 const float* towards, const float* limits, size_t slots, NearestOfQueries& nearest);

// Writes the sources that lie in a cone, ascending, and returns their number. Groups of 16 lanes hold x, y
// and z, and `isNear` 1 for a place or 0 for a direction. The test errs by up to 1e-6 of the product; sources
// nearer than 3e-15 are always included. `found` has room for all sources and 16 more.
size_t findInCone(const float* x, const float* y, const float* z, const float* isNear, size_t groups,
                  const SourceCone& cone, uint32_t* found);

// Writes the weights of the `count` nearest as ulrWeights gives them, truncated by `error`
// (ulr.h), 16 each; 0 where there is no source.
void writeWeights(const NearestOfQueries& nearest, size_t count, float error, float* weights);

// Rotates unit directions (`groups` of 16 x, y and z) by a 3 x 3 matrix, stored by columns, and locates them
// on the unfolded octahedron (light_table.cpp) of cells x cells: the number of the cell, row by row and below
// 2^24, and the position in the cell, rightwards and downwards, 0..1.
void findCells(const float* directions, size_t groups, const float* rotation, size_t cells, float* cell,
               float* right, float* down);

} // namespace surflect::weights
