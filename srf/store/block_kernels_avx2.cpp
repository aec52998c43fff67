#ifdef __AVX2__
#include "srf/store/block_kernels.h"

#include <immintrin.h>

#include "srf/store/block_kernels_loops.h"

namespace surflect {

extern const BlockKernels avx2BlockKernels;
const BlockKernels avx2BlockKernels = kernelsOf<32>();

} // namespace surflect
#endif
