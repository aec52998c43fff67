#include "srf/codec/block_kernels.h"

#include "srf/codec/block_kernels_loops.h"

#include "surfel/math/simd.h"

namespace surflect::codec {

extern const BlockKernels avx2BlockKernels, avx512BlockKernels;

const BlockKernels& blockKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512BlockKernels;
  if (simd == Simd::avx2) return avx2BlockKernels;
#endif
  static constexpr BlockKernels plain = kernelsOf<16>();
  return plain;
}

} // namespace surflect::codec
