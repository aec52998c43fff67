#include "warp/warp_kernels.h"

#include "warp/warp_kernel_loops.h"

namespace surflect::warp {

extern const WarpKernels scalarWarpKernels;
const WarpKernels scalarWarpKernels = kernelsOfTheseLanes;

} // namespace surflect::warp
