// Lines of a lumigraph from photographs, by ray tracing.
//
// [Azuma 1999, §4.1]
#pragma once

#include "render/lightfield/common/ray_radiance.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/lumigraph.h"
#include "render/lightfield/lumigraph/slab.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <vector>

namespace surflect::lumigraph {

using ResampleOptions = lightfield::RayBlend; // nearest: as [Azuma 1999, §4.1] does
using Sample = lightfield::RaySample;

// Lines of a node's picture by kind.
struct Tally {
  size_t seen = 0, unseen = 0, missed = 0;
};

class Resampler {
public:
  // Reads the training views of a capture, which must outlive this object. Throws Error and Cancelled.
  Resampler(const lightfield::Views& views, const ResampleOptions& options, const Progress& progress = {})
      : rays_(views, options, progress) {}

  // Radiance where a line first meets the object (ray_radiance.h).
  Sample at(const Line& line) const { return rays_.along(line.origin, line.direction); }

  // Picture of a node. A texel is the radiance of one line, that through its centre [Azuma 1999, §4.1]: the
  // mean over the texel's area would blur the photographs once more. Colours of lines that miss the object,
  // or that no view sees, are filled from those around them (pull_push.h). Throws Cancelled.
  std::vector<Texel> picture(const Slab& slab, int i, int j, Tally& tally,
                             const Progress& progress = {}) const;

private:
  lightfield::RayRadiance rays_;
};

} // namespace surflect::lumigraph
