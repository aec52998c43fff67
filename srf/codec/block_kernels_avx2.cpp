#ifdef __AVX2__
#include "srf/codec/block_kernels.h"

#include <immintrin.h>

#include "srf/codec/block_kernels_loops.h"

namespace surflect::codec {

extern const BlockKernels avx2BlockKernels;
const BlockKernels avx2BlockKernels = kernelsOf<32>();

} // namespace surflect::codec
#endif
