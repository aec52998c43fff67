// The lanes that the compiler was told to use. For the sources of kernels alone, see simd.h.
#pragma once

#if defined(__AVX512F__)
#include "surfel/lanes_avx512.h"
#elif defined(__AVX2__)
#include "surfel/lanes_avx2.h"
#else
#include "surfel/lanes_scalar.h"
#endif
