#ifdef __AVX512F__
#include "srf/ulr/nearest_kernels.h"

#include "srf/ulr/nearest_kernel_loops.h"

namespace surflect::ulr {

extern const NearestKernels avx512NearestKernels;
const NearestKernels avx512NearestKernels = kernelsOfTheseLanes;

} // namespace surflect::ulr
#endif
