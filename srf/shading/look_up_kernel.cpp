#include "srf/shading/look_up_kernel.h"

#include "srf/shading/look_up_kernel_loops.h"

#include "surfel/math/simd.h"

namespace surflect::shading {

extern const LookUpKernel avx2LookUp, avx512LookUp;

LookUpKernel lookUpKernel([[maybe_unused]] Simd simd) {
#ifdef __x86_64__
  if (simd == Simd::avx512) return avx512LookUp;
  if (simd == Simd::avx2) return avx2LookUp;
#endif
  return lookUp<Four>;
}

} // namespace surflect::shading
