#ifdef __AVX2__
#include "render/query_kernels.h"

#include "render/query_kernel_loops.h"

namespace surflect {

extern const QueryKernels avx2QueryKernels;
const QueryKernels avx2QueryKernels = kernelsOfTheseLanes;

} // namespace surflect
#endif
