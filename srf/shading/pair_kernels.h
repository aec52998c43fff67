// Vectorised loops of pair_weights.h: penalties of the pairs of the nearest views and lights, and the pairs
// of least penalty.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace surflect::shading {

inline constexpr size_t kNearSources = 6; // nearest views, and lights, whose pairs are considered
inline constexpr size_t kPairLanes = 8;   // lanes of a row of pairs, of which the last hold none
inline constexpr size_t kNearPairs = kNearSources * kPairLanes;

// Views or lights, one a lane. Lanes without one have confidence 0.
struct NearSources {
  size_t size = 0; // at most kNearSources
  std::array<uint32_t, kNearSources> index;
  std::array<float, kPairLanes> x{}, y{}, z{}; // unit directions towards them
  std::array<float, kPairLanes> confidence{};
  std::array<float, kPairLanes> reached{}; // shadow states of lights

  void clear() {
    size = 0;
    confidence.fill(0);
  }
  void add(uint32_t source, const Vec3<float>& towards, float trust, float shadowState = 1) {
    index[size] = source;
    x[size] = towards[0], y[size] = towards[1], z[size] = towards[2];
    confidence[size] = trust;
    reached[size++] = shadowState;
  }
  Vec3<float> towards(size_t i) const { return {x[i], y[i], z[i]}; }
};

// Requested pair, and the squared inverse of each scale (kriging.h).
struct RequestedPair {
  float light[3], view[3], half[3]; // unit directions; halfVector of both
  float shadow;                     // shadow state
  float ofHalf, ofLight, ofView;
  float ofShadow; // inverse, not squared
  bool isKriging;
};

// Writes the penalty of the pair of viewer v and light l at penalties[kPairLanes v + l], divided by the
// confidence in both; infinite where that is 0. Penalties are those of pair_weights.h. Squared distances are
// those of places (kriging.h) within 1e-6 ofHalf, or 2e-5 ofHalf near opposite directions. Every instruction
// set gives the same bits.
void writePairPenalties(const NearSources& viewers, const NearSources& lights, const RequestedPair& asked,
                        float* penalties);

// Writes the places of the `most` least of `count` penalties, ascending; of equal ones the first comes first.
// Infinite and NaN penalties are left out. Returns how many places were written. `count` is a multiple of
// kPairLanes; `penalties` is overwritten.
size_t findLeast(float* penalties, size_t count, size_t most, uint32_t* places, float* least);

} // namespace surflect::shading
