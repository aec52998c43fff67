#ifdef __AVX512F__
#include "warp/warp_kernels.h"

#include "warp/warp_kernel_loops.h"

namespace surflect::warp {

extern const WarpKernels avx512WarpKernels;
const WarpKernels avx512WarpKernels = kernelsOfTheseLanes;

} // namespace surflect::warp
#endif
