// How fast splats are drawn at 1024 x 768: covered, then blended with three values each. As in a film, the
// program keeps its memory from one picture to the next.
#pragma once

#include "bench/plain_splats/doll_cloud.h"
#include "bench/timing/laps.h"

#include <string>
#include <vector>

namespace surflect::bench {

// One way of drawing a doll: vector instructions by name, or "plain", by slow_coverage.h.
struct SplatTimes {
  SurfelOrder order = SurfelOrder::coherent;
  size_t splats = 0, visible = 0;
  int threads = 1;
  std::string way;
  double db = 0;      // from the plain picture, of colours up to 1; 999 for the same
  double flipped = 0; // share of pixels that are 0.001 and more apart: another surfel is seen
  Times cover, blend, both;
};

// Both orders on one thread and on two, the processor's vector instructions in turns with the plain way, of
// which there are fewer rounds. Throws Error below 100 dB, or where more than 2 pixels in 100,000 have
// flipped.
std::vector<SplatTimes> timeSplats(int rounds);

} // namespace surflect::bench
