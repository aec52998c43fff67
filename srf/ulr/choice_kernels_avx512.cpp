#ifdef __AVX512F__
#include "srf/ulr/choice_kernels.h"

#include "srf/ulr/choice_kernel_loops.h"

namespace surflect::ulr {

extern const ChoiceKernels avx512ChoiceKernels;
const ChoiceKernels avx512ChoiceKernels = kernelsOfTheseLanes;

} // namespace surflect::ulr
#endif
