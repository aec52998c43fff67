// One matte for all photographs of a view: they show one object from one place, under whatever light.
#pragma once

#include "srf/image/image.h"

#include <cstddef>
#include <vector>

namespace surflect::capture {

// Alpha as it is meant: mattes by networks and denoisers leave a haze of a few 255ths beside the object, and
// one 255th less than full on it.
inline float settledAlpha(float alpha) {
  constexpr float kClear = 3.5f / 255, kOpaque = 1 - 1.5f / 255;
  return alpha > kOpaque ? 1.f : alpha > kClear ? alpha : 0.f; // NaN is 0
}

// Mattes are added in any order. Those that show nothing of the object, or no background, count only if there
// are no others. In each pixel, the view's alpha is the largest that at least one matte in eight reaches:
// mattes made by a threshold lack what is in shadow.
class MatteVote {
public:
  // `mattes`: number of mattes that will be added, at most.
  explicit MatteVote(size_t mattes);

  // alpha: 1 channel, all of one size.
  void add(const image::Image& alpha);
  // Matte of the view; an empty image if none was added.
  image::Image outcome() const;

private:
  size_t kept_;                     // number of planes that may be needed
  size_t voting_ = 0;               // mattes with object and background
  std::vector<image::Image> ranks_; // in each pixel, the largest alpha of the voting mattes, the second, ..
  image::Image full_, empty_;       // largest alpha of the mattes without background, and without object
};

} // namespace surflect::capture
