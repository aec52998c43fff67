#ifdef __AVX2__
#include "render/splat/splat_kernels.h"

#include "render/splat/splat_kernel_loops.h"

namespace surflect::splat {

extern const SplatKernels avx2SplatKernels;
const SplatKernels avx2SplatKernels = kernelsOfTheseLanes;

} // namespace surflect::splat
#endif
