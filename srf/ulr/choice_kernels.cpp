#include "srf/ulr/choice_kernels.h"

#include "surfel/math/simd.h"

namespace surflect::ulr {

extern const ChoiceKernels scalarChoiceKernels, avx2ChoiceKernels, avx512ChoiceKernels;

const ChoiceKernels& choiceKernels([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512ChoiceKernels;
  if (simd == Simd::avx2) return avx2ChoiceKernels;
#endif
  return scalarChoiceKernels;
}

} // namespace surflect::ulr
