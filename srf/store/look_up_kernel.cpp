#include "srf/store/look_up_kernel.h"

#include "srf/store/look_up_kernel_loops.h"

#include "surfel/simd.h"

namespace surflect {

extern const LookUpKernel avx2LookUp;

LookUpKernel lookUpKernel([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd >= Simd::avx2) return avx2LookUp; // blocks have few terms: wider ones would be empty
#endif
  return lookUp<Four>;
}

} // namespace surflect
