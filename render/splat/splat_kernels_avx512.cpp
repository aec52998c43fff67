#ifdef __AVX512F__
#include "render/splat/splat_kernels.h"

#include "render/splat/splat_kernel_loops.h"

namespace surflect::splat {

extern const SplatKernels avx512SplatKernels;
const SplatKernels avx512SplatKernels = kernelsOfTheseLanes;

} // namespace surflect::splat
#endif
