#include "render/splat/splat_kernels.h"

#include "surfel/math/simd.h"

namespace surflect::splat {

extern const SplatKernels scalarSplatKernels, avx2SplatKernels, avx512SplatKernels;

const SplatKernels& splatKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512SplatKernels;
  if (simd == Simd::avx2) return avx2SplatKernels;
#endif
  return scalarSplatKernels;
}

} // namespace surflect::splat
