#ifdef __AVX2__
#include <immintrin.h>

#include "srf/codec/look_up_kernel_fused.h"

namespace surflect::codec {

extern const LookUpKernel avx2LookUp;
const LookUpKernel avx2LookUp = lookUp<Eight>;

} // namespace surflect::codec
#endif
