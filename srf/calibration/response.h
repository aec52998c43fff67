// Response curve of an 8-bit camera, recovered from exposure brackets.
//
// [Debevec 1997] P. Debevec, J. Malik: Recovering High Dynamic Range Radiance Maps from Photographs.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/bracket.h"
#include "surfel/base/time.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::calibration {

// Codes of one channel of one pixel, one per exposure of a bracket.
struct BracketPixel {
  std::span<const double> logSeconds;
  std::vector<uint8_t> codes;
};

// Returns g(z) = ln f^-1(z), the logarithm of the exposure of each code, with g(128) = 0. It minimises
//
//   sum over pixels i, exposures j of { w(Z_ij) [g(Z_ij) - ln E_i - ln dt_j] }^2
//   + lambda  sum over z of { w(z) g''(z) }^2          [Debevec 1997, Eq. 3 with the weights of Eq. 4]
//
// over g and all E_i. The first sum is normalised to a mean pixel, so that lambda does not depend on the
// number of pixels. Throws Error if the pixels do not determine g: no pixel has two codes within 1..254.
std::array<double, image::Response::codes> recoverLogResponse(std::span<const BracketPixel> pixels,
                                                              double lambda);

// Response of the camera that took the capture's brackets (frames with further exposures, 8 bits), from
// pixels spread evenly over all codes of at most 16 brackets. Scaled so that code 128 has its sRGB value;
// made non-decreasing where noise would make it fall. Throws Error without brackets, for pictures without 8
// bits, and as recoverLogResponse. Progress names the stage "response".
image::Response recoverResponse(const capture::Capture& capture, const Progress& progress);

} // namespace surflect::calibration
