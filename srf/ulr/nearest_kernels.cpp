#include "srf/ulr/nearest_kernels.h"

#include "surfel/math/simd.h"

namespace surflect::ulr {

extern const NearestKernels scalarNearestKernels, avx2NearestKernels, avx512NearestKernels;

const NearestKernels& nearestKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512NearestKernels;
  if (simd == Simd::avx2) return avx2NearestKernels;
#endif
  return scalarNearestKernels;
}

} // namespace surflect::ulr
