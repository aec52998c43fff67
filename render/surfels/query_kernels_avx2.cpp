#ifdef __AVX2__
#include "render/surfels/query_kernels.h"

#include "render/surfels/query_kernel_loops.h"

namespace surflect::surfels {

extern const QueryKernels avx2QueryKernels;
const QueryKernels avx2QueryKernels = kernelsOfTheseLanes;

} // namespace surflect::surfels
#endif
