// Tells whether alpha shows a translucent object, or only the edges of an opaque one.
#pragma once

#include "srf/image/image.h"

#include <cstddef>

namespace surflect::model {

// Least share of translucent pixels in a translucent object.
inline constexpr double kTranslucentShare = 0.05;

// Counts pixels with alpha above 0, and the translucent ones among them. Alpha between 0 and 1 is translucent
// unless opaque and clear pixels both lie within two pixels: those are edges that a pixel or a blur has
// averaged.
class TranslucencySurvey {
public:
  // alpha: 1 channel.
  void add(const image::Image& alpha);

  double share() const;
  bool isTranslucent() const { return share() >= kTranslucentShare; }

private:
  size_t object_ = 0, translucent_ = 0;
};

} // namespace surflect::model
