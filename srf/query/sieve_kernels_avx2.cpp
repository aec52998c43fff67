#ifdef __AVX2__
#include "srf/query/sieve_kernels.h"

#include "srf/query/sieve_kernel_loops.h"

namespace surflect {

extern const SieveKernels avx2SieveKernels;
const SieveKernels avx2SieveKernels = kernelsOfTheseLanes;

} // namespace surflect
#endif
