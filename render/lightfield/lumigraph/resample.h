// Lines of a lumigraph from photographs, by ray tracing.
//
// [Azuma 1999, §4.1]   [Buehler 2001] (srf/ulr/ulr.h)
// Symbols: P the point where a line first meets the object; penalty_c of view c 1 - cos(angle at P between
// the line and the direction to c), divided by fades of c.
#pragma once

#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/sight.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/lumigraph.h"
#include "render/lightfield/lumigraph/slab.h"
#include "srf/ulr/ulr.h"
#include "surfel/base/progress.h"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace surflect::lumigraph {

struct ResampleOptions {
  size_t views = 4;     // blended for each line, 1..ulr::kMaxBlended
  bool nearest = false; // takes the nearest view alone, as [Azuma 1999, §4.1] does
};

// Radiance of a line.
struct Sample {
  enum class Kind {
    missed, // the line does not meet the object
    unseen, // no view sees P
    seen
  };
  Kind kind = Kind::missed;
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
};

// Lines of a node's picture by kind.
struct Tally {
  size_t seen = 0, unseen = 0, missed = 0;
};

class Resampler {
public:
  // Reads the training views of a capture, which must outlive this object. Throws Error and Cancelled.
  Resampler(const lightfield::Views& views, const ResampleOptions& options, const Progress& progress = {});

  // Radiance at P: that of the nearest photograph that sees P (sight.h), or a blend by the weights of
  // unstructured lumigraph rendering.
  Sample at(const Line& line) const;

  // Picture of a node. A texel is the radiance of one line, that through its centre [Azuma 1999, §4.1]: the
  // mean over the texel's area would blur the photographs once more. Colours of lines that miss the object,
  // or that no view sees, are filled from those around them (pull_push.h). Throws Cancelled.
  std::vector<Texel> picture(const Slab& slab, int i, int j, Tally& tally,
                             const Progress& progress = {}) const;

private:
  const lightfield::Views& input_;
  ResampleOptions options_;
  lightfield::Photographs photographs_;
  lightfield::Sight sight_;
};

} // namespace surflect::lumigraph
