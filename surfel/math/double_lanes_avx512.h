// double_lanes_scalar.h in AVX-512.
#pragma once

#ifdef __AVX512F__
#include <immintrin.h>

#include <cstdint>

namespace surflect {
namespace {

struct DoubleLanes {
  __m512d v;

  DoubleLanes() = default;
  DoubleLanes(__m512d x) : v(x) {}
  DoubleLanes(double x) : v(_mm512_set1_pd(x)) {}
};

inline DoubleLanes load(const double* from) { return _mm512_loadu_pd(from); }
inline void store(double* to, DoubleLanes x) { _mm512_storeu_pd(to, x.v); }
inline DoubleLanes operator+(DoubleLanes x, DoubleLanes y) { return _mm512_add_pd(x.v, y.v); }
inline DoubleLanes operator-(DoubleLanes x, DoubleLanes y) { return _mm512_sub_pd(x.v, y.v); }
inline DoubleLanes operator*(DoubleLanes x, DoubleLanes y) { return _mm512_mul_pd(x.v, y.v); }
inline DoubleLanes operator/(DoubleLanes x, DoubleLanes y) { return _mm512_div_pd(x.v, y.v); }
inline DoubleLanes mulAdd(DoubleLanes x, DoubleLanes y, DoubleLanes z) {
  return _mm512_fmadd_pd(x.v, y.v, z.v);
}
inline DoubleLanes minusProduct(DoubleLanes z, DoubleLanes x, DoubleLanes y) {
  return _mm512_fnmadd_pd(x.v, y.v, z.v);
}
inline DoubleLanes min(DoubleLanes x, DoubleLanes y) { return _mm512_min_pd(x.v, y.v); }
inline DoubleLanes max(DoubleLanes x, DoubleLanes y) { return _mm512_max_pd(x.v, y.v); }
inline DoubleLanes sqrt(DoubleLanes x) { return _mm512_sqrt_pd(x.v); }
inline DoubleLanes absolute(DoubleLanes x) { return _mm512_abs_pd(x.v); }
inline DoubleLanes roundedToFloat(DoubleLanes x) { return _mm512_cvtps_pd(_mm512_cvtpd_ps(x.v)); }
inline uint32_t bitsOfLess(DoubleLanes x, DoubleLanes y) { return _mm512_cmp_pd_mask(x.v, y.v, _CMP_LT_OQ); }

struct DoubleTriples {
  DoubleLanes x, y, z;
};
inline DoubleTriples loadTriples(const float* from) {
  const __m512 front = _mm512_loadu_ps(from); // 16 of the 24 floats
  const __m512 back = _mm512_castps256_ps512(_mm256_loadu_ps(from + 16));
  const auto column = [&](int k) {
    const __m512i rows = _mm512_setr_epi32(k, k + 3, k + 6, k + 9, k + 12, k + 15, k + 18, k + 21, //
                                           0, 0, 0, 0, 0, 0, 0, 0);
    return _mm512_cvtps_pd(_mm512_castps512_ps256(_mm512_permutex2var_ps(front, rows, back)));
  };
  return {column(0), column(1), column(2)};
}
inline void storeTriples(float* to, const DoubleTriples& t) {
  // x in lanes 0 to 7, y in 8 to 15, z from 16 on.
  const __m512 xy =
      _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(t.x.v)), _mm512_cvtpd_ps(t.y.v), 1);
  const __m512 z = _mm512_castps256_ps512(_mm512_cvtpd_ps(t.z.v));
  const __m512i front = _mm512_setr_epi32(0, 8, 16, 1, 9, 17, 2, 10, 18, 3, 11, 19, 4, 12, 20, 5);
  const __m512i back = _mm512_setr_epi32(13, 21, 6, 14, 22, 7, 15, 23, 0, 0, 0, 0, 0, 0, 0, 0);
  _mm512_storeu_ps(to, _mm512_permutex2var_ps(xy, front, z));
  _mm256_storeu_ps(to + 16, _mm512_castps512_ps256(_mm512_permutex2var_ps(xy, back, z)));
}

} // namespace
} // namespace surflect

#endif
