#ifdef __AVX512VL__
#include <immintrin.h>

#include "srf/shading/look_up_kernel_fused.h"

namespace surflect::shading {

// As wide as AVX2's, for blocks have few terms and wider ones would be empty, but with twice as many
// registers.
extern const LookUpKernel avx512LookUp;
const LookUpKernel avx512LookUp = lookUp<Eight>;

} // namespace surflect::shading
#endif
