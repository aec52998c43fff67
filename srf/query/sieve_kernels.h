// The loops of candidate_sieve.h, compiled for each kind of vector instructions. Raw pointers only: see
// surfel/simd.h. Sources come in groups of kSieveLanes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surflect {

constexpr size_t kSieveLanes = 16;

// Nearer to a source than this part of how far both are from the middle, single precision has lost too much
// of the direction.
constexpr float kSieveNearest = 1.f / 64;

struct SieveSources {
  const float *x, *y, *z;  // places, or unit directions to what is distant
  const float* isNear;     // 1 for a place, 0 for a direction
  const float* fromMiddle; // length of (x, y, z) of a place, 0 for a direction
  size_t groups;
};

struct SieveDirections {
  float *x, *y, *z; // unit
};

struct SieveQuery {
  float x, y, z; // unit direction
  float slack;   // how far a penalty computed here may be off
  const uint8_t* fades;
  const float *coarse, *fine; // 1 / fade of a byte b is coarse[b / 16] fine[b % 16]
  size_t wanted;              // 1..32
};

struct SieveKernels {
  // Directions from a place at the given length from the middle; false if one of them is not to be trusted.
  bool (*lookFrom)(const SieveSources&, const float* place, float fromMiddle, const SieveDirections&);
  // Writes the sources with a fade of which fewer than `wanted` others are nearer for sure, ascending, and
  // returns how many. bounds: one per lane of each group; found: one per source.
  size_t (*nearest)(const SieveDirections&, size_t groups, const SieveQuery&, float* bounds, uint32_t* found);
};

enum class Simd;
const SieveKernels& sieveKernels(Simd simd);

} // namespace surflect
