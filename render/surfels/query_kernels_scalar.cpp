#include "render/surfels/query_kernels.h"

#include "render/surfels/query_kernel_loops.h"

namespace surflect::surfels {

extern const QueryKernels scalarQueryKernels;
const QueryKernels scalarQueryKernels = kernelsOfTheseLanes;

} // namespace surflect::surfels
