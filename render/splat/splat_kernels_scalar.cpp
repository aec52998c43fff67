#include "render/splat/splat_kernels.h"

#include "render/splat/splat_kernel_loops.h"

namespace surflect::splat {

extern const SplatKernels scalarSplatKernels;
const SplatKernels scalarSplatKernels = kernelsOfTheseLanes;

} // namespace surflect::splat
