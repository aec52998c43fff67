// What a camera of 8 bits makes of light, told from exposure brackets.
//
// [Debevec 1997] P. Debevec, J. Malik: Recovering High Dynamic Range Radiance Maps from Photographs.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/response.h"
#include "surfel/base/progress.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::calibration {

// One channel of one pixel in the exposures of a bracket, one code each.
struct BracketPixel {
  std::span<const double> logSeconds;
  std::vector<uint8_t> codes;
};

// g(z) = ln f^-1(z), the logarithm of the exposure that a code stands for, with g(128) = 0: minimises
//
//   sum over pixels i, exposures j of { w(Z_ij) [g(Z_ij) - ln E_i - ln dt_j] }^2
//   + lambda  sum over z of { w(z) g''(z) }^2          [Debevec 1997, Eq. 3 with the weights of Eq. 4]
//
// over g and all E_i. The first sum is taken for a mean pixel, so that lambda means the same for any number
// of pixels. Throws Error where the pixels do not determine g: no pixel has two codes within 1..254.
std::array<double, image::Response::codes> recoverLogResponse(std::span<const BracketPixel> pixels,
                                                              double lambda);

// The response of the camera that made the capture's brackets (frames with further exposures, 8 bits), from
// pixels spread evenly over all codes of at most 16 brackets. Scaled so that code 128 stands for what it does
// in sRGB; where noise would make it fall, level. Throws Error: without brackets, for pictures that do not
// have 8 bits, and as above. Progress names the stage "response".
image::Response recoverResponse(const capture::Capture& capture, const Progress& progress);

} // namespace surflect::calibration
