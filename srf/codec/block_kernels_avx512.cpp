#ifdef __AVX512F__
#include "srf/codec/block_kernels.h"

#include <immintrin.h>

#include "srf/codec/block_kernels_loops.h"

namespace surflect::codec {

extern const BlockKernels avx512BlockKernels;
const BlockKernels avx512BlockKernels = kernelsOf<64>();

} // namespace surflect::codec
#endif
