// The lanes that the compiler was told to use. For the sources of kernels alone, see simd.h. What each
// function gives is said in lanes_scalar.h; timesPowerOfTwo of 0 is what it likes, like that of what is too
// small or large.
#pragma once

#if defined(__AVX512F__)
#include "surfel/math/lanes_avx512.h"
#elif defined(__AVX2__)
#include "surfel/math/lanes_avx2.h"
#else
#include "surfel/math/lanes_scalar.h"
#endif
