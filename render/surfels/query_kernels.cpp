#include "render/surfels/query_kernels.h"

#include "surfel/math/simd.h"

namespace surflect::surfels {

extern const QueryKernels scalarQueryKernels, avx2QueryKernels, avx512QueryKernels;

const QueryKernels& queryKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512QueryKernels;
  if (simd == Simd::avx2) return avx2QueryKernels;
#endif
  return scalarQueryKernels;
}

} // namespace surflect::surfels
