// Eight doubles at a time, in the lanes that the compiler was told to use. For the sources of kernels alone,
// see simd.h. A number stands for eight of it, so that equations read as on paper.
#pragma once

#if defined(__AVX512F__)
#include "surfel/math/double_lanes_avx512.h"
#elif defined(__AVX2__)
#include "surfel/math/double_lanes_avx2.h"
#else
#include "surfel/math/double_lanes_scalar.h"
#endif
