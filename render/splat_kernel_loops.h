// The loops of splat_kernels.h, in the lanes that the compiler was told to use.
#pragma once

#include "render/splat_blend_loops.h"
#include "render/splat_layer_loops.h"
#include "render/splat_project_loops.h"

namespace surflect {
namespace {

constexpr SplatKernels kernelsOfTheseLanes{projectLoop,     listBlocksLoop, resolveBlockLoop,
                                           gatherPixelLoop, firstLayerLoop, rankPixelLoop,
                                           keepSeenLoop,    blendBlockLoop, meanOrderLoop};

} // namespace
} // namespace surflect
