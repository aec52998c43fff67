// Frames of a model whose cache holds less than a frame needs: how long they take, and in how much memory.
#pragma once

#include "bench/doll/frame_times.h"

namespace surflect::bench {

struct BoundedFrames {
  size_t cacheBytes = 0;
  double surfelBytes = 0, frameBytes = 0; // of the cloud with its fades; of the picture
  double peakBytes = 0;                   // resident while the frames were rendered
  double anonymousBytes = 0;              // resident afterwards
  double coldSeconds = 0, warmSeconds = 0;

  // What may be resident: this much beside surfels, film and cache.
  static constexpr double kBeside = 256 * 1024 * 1024;
  double allowedBytes() const { return surfelBytes + frameBytes + static_cast<double>(cacheBytes) + kBeside; }
};

// A frame from the disk and one more, whose blocks the system has in memory. The peak is that of the process:
// to be asked before other work has filled its heap.
BoundedFrames boundedFrames(const model::Model& model, const Shot& shot, size_t cacheBytes);

} // namespace surflect::bench
