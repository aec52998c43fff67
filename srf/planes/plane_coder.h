// Planes as grey JPEG pictures of 8 bits.
//
// Planes of an orthonormal basis add their errors: the sum is least where each plane has the same error
// [Cover 2006, §10.3.3, reverse water-filling]. So the steps of the transform are as large in each plane's
// own unit: a plane of a tenth of the first one's range has ten times its steps on the way from 0 to 255.
//
// [Cover 2006] T. M. Cover, J. A. Thomas: Elements of Information Theory, 2nd edition.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::planes {

// Values of a plane that the bytes 0 and 255 stand for, and the quality of its JPEG.
struct PlaneRange {
  float least = 0, most = 1;
  int quality = 90; // 1 to 100
};

// Range of a plane's values, at full width if they are all equal.
PlaneRange rangeOf(std::span<const float> values);

// Scale of JPEG's table of steps in percent, by quality: 5000 / q below 50, then 200 - 2 q [libjpeg,
// jcparam.c].
double stepsOf(int quality);
// Sets each range's quality so that its steps are those of `quality` at the widest range.
void shareSteps(std::span<PlaneRange> ranges, int quality);

// Byte nearest to a value; values beyond the range are clamped.
uint8_t byteOf(const PlaneRange& range, float value);
inline float valueOf(const PlaneRange& range, uint8_t byte) {
  return range.least + (range.most - range.least) * static_cast<float>(byte) / 255;
}

// A grey JPEG of width x height bytes.
std::string greyJpeg(std::span<const uint8_t> grey, int width, int height, int quality);
// Bytes of a grey JPEG of that size. Throws Error.
std::vector<uint8_t> greyOf(std::string_view jpeg, int width, int height);

} // namespace surflect::planes
