#ifdef __AVX2__
#include "srf/ulr/choice_kernels.h"

#include "srf/ulr/choice_kernel_loops.h"

namespace surflect::ulr {

extern const ChoiceKernels avx2ChoiceKernels;
const ChoiceKernels avx2ChoiceKernels = kernelsOfTheseLanes;

} // namespace surflect::ulr
#endif
