// The loops of look_up_kernel.h where products are not rounded: AVX2 and what includes it.
#pragma once

#ifdef __AVX2__
#include "srf/shading/look_up_kernel_loops.h"

namespace surflect::shading {
namespace {

template <> inline Eight levels(const int8_t* from) {
  return _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from))));
}
template <> inline Eight mulAdd(Eight x, Eight y, Eight z) { return _mm256_fmadd_ps(x, y, z); }
template <> inline Four mulAdd(Four x, Four y, Four z) { return _mm_fmadd_ps(x, y, z); }
template <> inline Four sumsOf(Four red, Four green, Four blue) {
  return _mm_hadd_ps(_mm_hadd_ps(red, green), _mm_hadd_ps(blue, blue));
}

} // namespace
} // namespace surflect::shading
#endif
