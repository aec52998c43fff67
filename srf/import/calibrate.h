// Estimates what imported captures lack, from all photographs of a view, few of them in memory at a time.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/time.h"

#include <span>
#include <string>
#include <vector>

namespace surflect::importers {

// Radiance of a frame's photograph, 3 channels. Throws Error.
image::Image radianceOf(const capture::Capture& capture, size_t frame);

// Means over squares of factor x factor pixels; incomplete squares at the right and below are dropped. The
// image has at least factor pixels each way.
image::Image shrunk(const image::Image& image, int factor);
// Mask of the squares that are completely in the mask.
image::Mask shrunk(const image::Mask& mask, int factor);

// Object pixels by threshold (srf/calibration/strengths.h) of the view of the given frames (indices into
// capture.frames). Pixels outside of a matte count as black. Throws Error.
image::Mask objectOfView(const capture::Capture& capture, std::span<const size_t> frames, double threshold,
                         const Progress& progress = {});

// Relative irradiances, mean 1, of the directional lights of frames of one view, from photographs reduced to
// at most 2^18 pixels. `unevenly`: with gradients, for training frames alone. Lights of test frames get no
// gradient, so that nothing but their strength comes from test photographs. The origin is at the middle of
// the picture. Throws Error for a damaged photograph.
struct StrengthEstimate {
  std::vector<capture::DirectionalLight> lights; // one per frame; empty if strengths cannot be determined
  std::string problem;                           // reason for missing lights or missing gradients
};
StrengthEstimate strengthsInView(const capture::Capture& capture, std::span<const size_t> frames,
                                 const image::Mask& object, bool unevenly, const Progress& progress = {});

} // namespace surflect::importers
