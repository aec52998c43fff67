// Share of a picture that can be trusted, by its predicted errors.
#pragma once

#include "srf/image/image.h"

#include <cstddef>

namespace surflect::evaluation {

// A pixel is trusted if its predicted error, RMS over the channels in linear light, is at most this part of
// the picture's white.
inline constexpr double kTrustedError = 10 / 255.;

// Numbers of pixels with alpha above 1/2 and of trusted pixels among them, in one or more pictures.
struct Trust {
  size_t pixels = 0, trusted = 0;

  double share() const { return pixels > 0 ? static_cast<double>(trusted) / static_cast<double>(pixels) : 1; }
  Trust& operator+=(const Trust& other) {
    pixels += other.pixels;
    trusted += other.trusted;
    return *this;
  }
};

// color: RGBA; predictedError: one channel; white: radiance of white. Both images have one size.
Trust trustIn(const image::Image& color, const image::Image& predictedError, double white);

} // namespace surflect::evaluation
