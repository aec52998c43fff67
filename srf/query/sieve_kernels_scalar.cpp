#include "srf/query/sieve_kernels.h"

#include "srf/query/sieve_kernel_loops.h"

namespace surflect {

extern const SieveKernels scalarSieveKernels;
const SieveKernels scalarSieveKernels = kernelsOfTheseLanes;

} // namespace surflect
