// Directions from surfels to viewer and lights, brought back to where reflectance was captured, in vector
// instructions. All instruction sets with fused multiply-add give the same bits; others round a b + c twice.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surflect::surfels {

// A viewer or light, and where its directions and irradiances go.
struct QuerySource {
  bool isDistant = false;
  double place[3]{};           // object space; if distant, the unit direction towards it
  float strength[3]{};         // irradiance if distant, else intensity
  float* towards = nullptr;    // 3 numbers for the first query: unit, acquisition space
  float* irradiance = nullptr; // likewise; or null
  size_t stride = 0;           // numbers from one query to the next
};

struct QueryJob {
  const float *r0, *p, *u, *v; // 3 numbers per surfel of the cloud: cloud.h
  const int8_t* handedness;    // one per surfel of the cloud; not 0 for those queried
  const uint32_t* surfels;     // one per query
  const QuerySource* sources;
  size_t sourceCount;
};

// Fills in the queries [begin, end), in double precision except for inputs and outputs.
void fillQueries(const QueryJob&, size_t begin, size_t end);

} // namespace surflect::surfels
