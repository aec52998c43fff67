#ifdef __AVX512F__
#include "render/surfels/query_kernels.h"

#include "render/surfels/query_kernel_loops.h"

namespace surflect::surfels {

extern const QueryKernels avx512QueryKernels;
const QueryKernels avx512QueryKernels = kernelsOfTheseLanes;

} // namespace surflect::surfels
#endif
