#include "srf/query/sieve_kernels.h"

#include "surfel/simd.h"

namespace surflect {

extern const SieveKernels scalarSieveKernels, avx2SieveKernels, avx512SieveKernels;

const SieveKernels& sieveKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512SieveKernels;
  if (simd == Simd::avx2) return avx2SieveKernels;
#endif
  return scalarSieveKernels;
}

} // namespace surflect
