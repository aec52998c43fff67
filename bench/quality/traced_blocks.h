// Some blocks of the photographs of a light stage, traced without the rest. Each block is compressed by
// itself, so that some tell what all would come to.
#pragma once

#include "render/stage/stage_file.h"
#include "srf/codec/view_encoder.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <vector>

namespace surflect::bench {

struct BlockSample {
  size_t views = 8; // at most, of those for training, evenly chosen
  size_t every = 8; // block of each of them, evenly over the picture
};

// Under all lights for training, rounded as a capture's file would have them: the blocks of each view side by
// side in a square. Noise is not that of the capture, but as strong. Throws Cancelled.
std::vector<codec::ReflectanceStack> traceBlocks(const stage::Stage& stage, const BlockSample& sample,
                                                 const Progress& progress = {});

} // namespace surflect::bench
