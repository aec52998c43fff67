// How near compressed photographs of an object are to it, at a given size.
#pragma once

#include "srf/codec/view_encoder.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <span>

namespace surflect::bench {

struct PackingQuality {
  double tolerance = 0;
  double bytes = 0;              // for each pixel of the object and light, all of the view files counted
  double db = 0;                 // linear, as psnrDb
  size_t texels = 0, lights = 0; // of the object
  double white = 1;
};

// Of photographs with a matte, packed at the tolerance that comes nearest to so many bytes (for each pixel
// and light) from below, of those between 0.005 and 0.5. White is what pack takes for it. Throws Error where
// nothing of an object is seen, where more bytes are needed, and Cancelled.
PackingQuality qualityAt(double bytes, std::span<const codec::ReflectanceStack> views,
                         const Progress& progress = {});

} // namespace surflect::bench
