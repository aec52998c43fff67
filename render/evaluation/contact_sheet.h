// Contact sheet: overlays of many photographs in one image.
#pragma once

#include "render/evaluation/overlay.h"

namespace surflect::evaluation {

// Selects up to `count` frames, spread evenly over views and lights, in their order.
std::vector<size_t> spreadFrames(const capture::Capture& capture, size_t count);

struct ContactSheet {
  image::Image image; // three channels of sRGB values; narrower than 4000 pixels
  std::vector<Overlay> overlays;
};

// Reads the photographs of at least one frame and draws a tile for each in the given order: a label above,
// the photograph with outlines on the left, the white surface on the right. Tiles are cropped to the
// surroundings of the geometry, unless it lies outside the photograph. All photographs share one exposure and
// all white surfaces another; each exposure maps the 99.5th percentile over the geometry to white. Throws
// Error and Cancelled.
ContactSheet contactSheet(const capture::Capture& capture, std::span<const size_t> frames,
                          const WhiteSurface& surface, const Progress& progress);

} // namespace surflect::evaluation
