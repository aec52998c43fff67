// White level of the photographs of an object.
#pragma once

#include "srf/codec/view_encoder.h"
#include "srf/image/mask.h"
#include "srf/image/percentile.h"
#include "surfel/base/progress.h"

namespace surflect::model {

// Accumulates the 99.5th percentile of the object's radiance over all channels.
class WhiteLevel {
public:
  void add(const codec::ReflectanceStack& stack, const image::Mask& object, const Progress& progress = {});

  bool isKnown() const { return values_.count() > 0; } // true once an object texel was added
  double value() const;                                // within 1e-20..1e20

private:
  image::PercentileCounter values_;
};

} // namespace surflect::model
