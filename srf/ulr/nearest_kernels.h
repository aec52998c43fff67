// The loops of nearest_sources.h and light_table.h in vector instructions. Queries, or directions, are in
// lanes: arrays of lanes have kQueryLanes floats, vectors in lanes three such arrays one after another.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surflect::ulr {

constexpr size_t kQueryLanes = 16;
constexpr size_t kMaxNearest = 17; // kMaxBlended and the next one

// A Source (nearest_sources.h) with each double split into a sum of two floats.
struct SplitSource {
  float x, y, z, restX, restY, restZ;
  bool isDistant;
};

// Per lane the sources of smallest penalty, ascending, ties by the order of candidates; a penalty is infinite
// where there is no source.
struct NearestOfQueries {
  float penalty[kMaxNearest][kQueryLanes], index[kMaxNearest][kQueryLanes];
};

// A cone of directions from `place`: unit vectors whose scalar product with `towards` is at least `least`.
struct SourceCone {
  float place[3];
  float towards[3];
  float least;
};

// Writes unit directions from 16 places to sources[which[c]], or to sources[c] where `which` is null, to
// towards + 48 c. Returns a bit for each lane that has lost a direction: the source is nearer than 1e-15 or
// farther than 1e15.
uint32_t writeDirections(const SplitSource* sources, const uint32_t* which, size_t count, const float* places,
                         float* towards);

// Writes per lane the largest penalty, as of findNearest, to the candidates `which`; infinite where one is
// not a number.
void writeLargestPenalties(const float* candidates, const uint32_t* which, size_t count, const float* towards,
                           float* penalties);

// Finds the `slots` nearest of `count` candidates, which are sources[which[c]] or c as above and have unit
// directions at candidates + 48 c, by their penalties |a - b|^2 / 2 over fade: 1 / fade is at inverseFades +
// 16 c, 1 where that is null, and infinite where a candidate is left out. limits: the largest penalties that
// count. slots: 1..kMaxNearest; may write more.
void findNearest(const float* candidates, const uint32_t* which, const float* inverseFades, size_t count,
                 const float* towards, const float* limits, size_t slots, NearestOfQueries& nearest);

// Writes the sources (in groups of 16 lanes: x, y, z of all, and 1 for a place or 0 for a direction) that lie
// in a cone, ascending, and returns their number. The product may be off by 1e-6; sources nearer than 3e-15
// are always found. found: one per source, and 16 more.
size_t findInCone(const float* x, const float* y, const float* z, const float* isNear, size_t groups,
                  const SourceCone& cone, uint32_t* found);

// Writes, for one query, the penalty of every source and the cosine of the direction to it with a normal,
// both within 2e-6; 0 where the direction is lost. Coordinates as above, and `rest` what rounding left of x,
// y, z, a third each of `groups` lanes; place, direction and normal: three numbers each.
void writeAngles(const float* x, const float* y, const float* z, const float* rest, const float* isNear,
                 size_t groups, const float* query, float* penalties, float* cosines);

// Writes the weights of the `count` nearest [ulrWeights], 16 each; 0 where there is no source. Returns a bit
// for each lane all of whose weights are above 0.
uint32_t writeWeights(const NearestOfQueries& nearest, size_t count, float* weights);

// Finds where unit directions, in `groups` of x, y and z of 16, turned by a 3 x 3 matrix, column by column,
// lie on the unfolded octahedron (light_table.cpp) of cells x cells: the number of the cell, row by row and
// below 2^24, and how far right and down in it, 0..1.
void findCells(const float* directions, size_t groups, const float* rotation, size_t cells, float* cell,
               float* right, float* down);

} // namespace surflect::ulr
