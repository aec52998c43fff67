#ifdef __AVX512F__
#include "render/query_kernels.h"

#include "render/query_kernel_loops.h"

namespace surflect {

extern const QueryKernels avx512QueryKernels;
const QueryKernels avx512QueryKernels = kernelsOfTheseLanes;

} // namespace surflect
#endif
