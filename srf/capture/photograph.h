// Pixels of a capture, as linear radiance of Rec. 709's primaries and white.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::capture {

// Both images have the size of the view's lens.
struct Photograph {
  image::Image radiance; // 3 channels, in the photograph's own scale: linear, divided by alpha and exposure,
                         // a bracket merged. Noise below zero is kept. Black where alpha is 0.
  image::Image
      alpha; // 1 channel, 0..1: the picture's alpha (the first's of a bracket) times the mask; 1 without
  bool hasMatte = false;    // the picture has alpha, or a mask
  size_t invalidTexels = 0; // were NaN or infinite, are black now
};

// The photographs of the given frames (indices into capture.frames), in that order. Each file is opened and
// decompressed once: ask for all frames of one view, whose lights often share a file, and not for more than
// memory holds: 16 bytes a pixel and frame; while reading 4 for each mask, and up to 32, or 44 where an
// ICC profile decodes it, for each picture of the files that are being read, one a thread, and of brackets
// that are not complete. Throws Error naming one picture that is wrong.
std::vector<Photograph> readPhotographs(const Capture& capture, std::span<const size_t> frames,
                                        const Progress& progress = {});

// What photographs of one view show together.
struct ViewPhotographs {
  std::vector<image::Image> radiance; // of each frame
  image::Image alpha;                 // of each pixel the least
  bool hasMatte = false;              // some photograph has one
  size_t invalidTexels = 0;           // of all
};

// The same for frames of one view; they take 12 bytes a pixel and frame, not 16. Of no frames it is empty.
ViewPhotographs readViewPhotographs(const Capture& capture, std::span<const size_t> frames,
                                    const Progress& progress = {});

} // namespace surflect::capture
