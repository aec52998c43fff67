#include "warp/warp_kernels.h"

#include "surfel/math/simd.h"

namespace surflect::warp {

extern const WarpKernels scalarWarpKernels, avx2WarpKernels, avx512WarpKernels;

const WarpKernels& warpKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512WarpKernels;
  if (simd == Simd::avx2) return avx2WarpKernels;
#endif
  return scalarWarpKernels;
}

} // namespace surflect::warp
