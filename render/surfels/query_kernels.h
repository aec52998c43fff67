// Directions from surfels to where they are seen and lit from, brought back to where they were captured, in
// the instructions that a processor has. Raw pointers only: see surfel/math/simd.h. avx2 and avx512 give the
// same bits; scalar rounds a b + c twice.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surflect {
enum class Simd;
}

namespace surflect::surfels {

// A viewer or light, and where to write what it is to the queries.
struct QuerySource {
  bool isDistant = false;
  double place[3]{};           // object space; of what is distant the unit direction towards it
  float strength[3]{};         // irradiance of what is distant, intensity of what is near
  float* towards = nullptr;    // 3 numbers for the first query: unit, acquisition space
  float* irradiance = nullptr; // likewise; or null
  size_t stride = 0;           // numbers from one query to the next
};

struct QueryJob {
  const float *r0, *p, *u, *v; // 3 numbers a surfel of the cloud: frame.h, cloud.h
  const int8_t* handedness;    // one each; not 0 where there is a query
  const uint32_t* surfels;     // one a query
  const QuerySource* sources;
  size_t sourceCount;
};

struct QueryKernels {
  // Answers the queries [begin, end), in double precision but for what is read and written.
  void (*direct)(const QueryJob&, size_t begin, size_t end);
};

const QueryKernels& queryKernels(Simd simd);

} // namespace surflect::surfels
