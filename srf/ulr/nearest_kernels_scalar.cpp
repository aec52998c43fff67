#include "srf/ulr/nearest_kernels.h"

#include "srf/ulr/nearest_kernel_loops.h"

namespace surflect::ulr {

extern const NearestKernels scalarNearestKernels;
const NearestKernels scalarNearestKernels = kernelsOfTheseLanes;

} // namespace surflect::ulr
