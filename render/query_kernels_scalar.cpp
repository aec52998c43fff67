#include "render/query_kernels.h"

#include "render/query_kernel_loops.h"

namespace surflect {

extern const QueryKernels scalarQueryKernels;
const QueryKernels scalarQueryKernels = kernelsOfTheseLanes;

} // namespace surflect
