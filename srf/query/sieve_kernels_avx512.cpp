#ifdef __AVX512F__
#include "srf/query/sieve_kernels.h"

#include "srf/query/sieve_kernel_loops.h"

namespace surflect {

extern const SieveKernels avx512SieveKernels;
const SieveKernels avx512SieveKernels = kernelsOfTheseLanes;

} // namespace surflect
#endif
