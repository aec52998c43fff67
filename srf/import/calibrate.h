// What other people's captures lack, estimated from all photographs of a view, a few of them in memory at a
// time.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/progress.h"

#include <span>
#include <string>
#include <vector>

namespace surflect::importers {

// Means over squares of factor x factor pixels; what does not fill a square at the right and below is left
// out. The image has at least factor pixels each way.
image::Image shrunk(const image::Image& image, int factor);
// Pixels all of whose square is in the mask.
image::Mask shrunk(const image::Mask& mask, int factor);

// Object pixels by threshold (srf/calibration/threshold_mask.h) of the view that the given frames (indices
// into capture.frames) photograph. Black where a matte is: no object.
// Throws Error.
image::Mask objectOfView(const capture::Capture& capture, std::span<const size_t> frames, double threshold,
                         const Progress& progress = {});

// Irradiances (relative, mean 1) of the directional lights of the given frames of one view, from photographs
// shrunk to at most 2^18 pixels; `unevenly` with gradients, from what trains alone: lights of test frames are
// even, so that of these nothing but the strength is known. The middle of the picture shows the origin.
// Throws Error for a damaged photograph.
struct StrengthEstimate {
  std::vector<capture::DirectionalLight> lights; // one a frame; none where their strengths cannot be told
  std::string problem;                           // why there are none, or why none has a gradient
};
StrengthEstimate strengthsInView(const capture::Capture& capture, std::span<const size_t> frames,
                                 const image::Mask& object, bool unevenly, const Progress& progress = {});

} // namespace surflect::importers
