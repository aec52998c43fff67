#ifdef __AVX2__
#include "srf/ulr/nearest_kernels.h"

#include "srf/ulr/nearest_kernel_loops.h"

namespace surflect::ulr {

extern const NearestKernels avx2NearestKernels;
const NearestKernels avx2NearestKernels = kernelsOfTheseLanes;

} // namespace surflect::ulr
#endif
