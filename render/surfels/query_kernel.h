// Directions from surfels to viewer and lights, brought back to where reflectance was captured, in vector
// instructions. Every instruction set with fused multiplication gives the same bits; without, a b + c is
// rounded twice.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surflect::surfels {

// A viewer or light, and where its directions and irradiances go.
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

// Fills in the queries [begin, end), in double precision but for what is read and written.
void fillQueries(const QueryJob&, size_t begin, size_t end);

} // namespace surflect::surfels
