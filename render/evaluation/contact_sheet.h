// Overlays of many photographs as one picture.
#pragma once

#include "render/evaluation/overlay.h"

namespace surflect::evaluation {

// Up to `count` frames, spread evenly over views and lights, in their order.
std::vector<size_t> spreadFrames(const capture::Capture& capture, size_t count);

struct ContactSheet {
  image::Image image; // three channels of sRGB values, less than 4000 pixels wide
  std::vector<Overlay> overlays;
};

// Reads the photographs of the frames, at least one, and draws them in the given order: left of each tile the
// photograph with outlines, right the white surface, above them a label. Shown is what lies around the
// geometry, the whole photograph where that is not in it. Photographs share one exposure and white surfaces
// another, such that the 99.5th percentile over the geometry of all tiles is white. Throws Error and
// Cancelled.
ContactSheet contactSheet(const capture::Capture& capture, std::span<const size_t> frames,
                          const WhiteSurface& surface, const Progress& progress);

} // namespace surflect::evaluation
