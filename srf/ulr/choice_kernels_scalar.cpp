#include "srf/ulr/choice_kernels.h"

#include "srf/ulr/choice_kernel_loops.h"

namespace surflect::ulr {

extern const ChoiceKernels scalarChoiceKernels;
const ChoiceKernels scalarChoiceKernels = kernelsOfTheseLanes;

} // namespace surflect::ulr
