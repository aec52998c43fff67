#ifdef __AVX2__
#include "warp/warp_kernels.h"

#include "warp/warp_kernel_loops.h"

namespace surflect::warp {

extern const WarpKernels avx2WarpKernels;
const WarpKernels avx2WarpKernels = kernelsOfTheseLanes;

} // namespace surflect::warp
#endif
