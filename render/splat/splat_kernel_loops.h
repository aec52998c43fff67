// The loops of splat_kernels.h, in the lanes that the compiler was told to use.
#pragma once

#include "render/splat/splat_blend_loops.h"
#include "render/splat/splat_layer_loops.h"
#include "render/splat/splat_place_loops.h"
#include "render/splat/splat_project_loops.h"

namespace surflect::splat {
namespace {

constexpr SplatKernels kernelsOfTheseLanes{projectLoop,   placeSplatsLoop, resolveBlockLoop, gatherPixelLoop,
                                           rankPixelLoop, keepSeenLoop,    blendBlockLoop,   meanOrderLoop};

} // namespace
} // namespace surflect::splat
