#ifdef __AVX2__
#include <immintrin.h>

#include "srf/shading/look_up_kernel_fused.h"

namespace surflect::shading {

extern const LookUpKernel avx2LookUp;
const LookUpKernel avx2LookUp = lookUp<Eight>;

} // namespace surflect::shading
#endif
