// double_lanes_scalar.h in AVX2 and FMA, as two halves.
#pragma once

#ifdef __AVX2__
#include <immintrin.h>

#include <cstdint>

namespace surflect {
namespace {

struct DoubleLanes {
  __m256d a, b;

  DoubleLanes() = default;
  DoubleLanes(__m256d low, __m256d high) : a(low), b(high) {}
  DoubleLanes(double x) : a(_mm256_set1_pd(x)), b(a) {}
};

inline DoubleLanes load(const double* from) { return {_mm256_loadu_pd(from), _mm256_loadu_pd(from + 4)}; }
inline void store(double* to, DoubleLanes x) {
  _mm256_storeu_pd(to, x.a);
  _mm256_storeu_pd(to + 4, x.b);
}
inline DoubleLanes operator+(DoubleLanes x, DoubleLanes y) {
  return {_mm256_add_pd(x.a, y.a), _mm256_add_pd(x.b, y.b)};
}
inline DoubleLanes operator-(DoubleLanes x, DoubleLanes y) {
  return {_mm256_sub_pd(x.a, y.a), _mm256_sub_pd(x.b, y.b)};
}
inline DoubleLanes operator*(DoubleLanes x, DoubleLanes y) {
  return {_mm256_mul_pd(x.a, y.a), _mm256_mul_pd(x.b, y.b)};
}
inline DoubleLanes operator/(DoubleLanes x, DoubleLanes y) {
  return {_mm256_div_pd(x.a, y.a), _mm256_div_pd(x.b, y.b)};
}
inline DoubleLanes mulAdd(DoubleLanes x, DoubleLanes y, DoubleLanes z) {
  return {_mm256_fmadd_pd(x.a, y.a, z.a), _mm256_fmadd_pd(x.b, y.b, z.b)};
}
inline DoubleLanes minusProduct(DoubleLanes z, DoubleLanes x, DoubleLanes y) {
  return {_mm256_fnmadd_pd(x.a, y.a, z.a), _mm256_fnmadd_pd(x.b, y.b, z.b)};
}
inline DoubleLanes min(DoubleLanes x, DoubleLanes y) {
  return {_mm256_min_pd(x.a, y.a), _mm256_min_pd(x.b, y.b)};
}
inline DoubleLanes max(DoubleLanes x, DoubleLanes y) {
  return {_mm256_max_pd(x.a, y.a), _mm256_max_pd(x.b, y.b)};
}
inline DoubleLanes sqrt(DoubleLanes x) { return {_mm256_sqrt_pd(x.a), _mm256_sqrt_pd(x.b)}; }
inline DoubleLanes absolute(DoubleLanes x) {
  const __m256d sign = _mm256_set1_pd(-0.0);
  return {_mm256_andnot_pd(sign, x.a), _mm256_andnot_pd(sign, x.b)};
}
inline DoubleLanes roundedToFloat(DoubleLanes x) {
  return {_mm256_cvtps_pd(_mm256_cvtpd_ps(x.a)), _mm256_cvtps_pd(_mm256_cvtpd_ps(x.b))};
}
inline uint32_t bitsOfLess(DoubleLanes x, DoubleLanes y) {
  const int low = _mm256_movemask_pd(_mm256_cmp_pd(x.a, y.a, _CMP_LT_OQ)),
            high = _mm256_movemask_pd(_mm256_cmp_pd(x.b, y.b, _CMP_LT_OQ));
  return static_cast<uint32_t>(low | high << 4);
}

struct DoubleTriples {
  DoubleLanes x, y, z;
};
// Four triples: x0 y0 z0 x1, y1 z1 x2 y2, z2 x3 y3 z3 become x0..x3, y0..y3, z0..z3.
struct FourTriples {
  __m128 x, y, z;
};
inline FourTriples loadFourTriples(const float* from) {
  const __m128 a = _mm_loadu_ps(from), b = _mm_loadu_ps(from + 4), c = _mm_loadu_ps(from + 8);
  const __m128 yz = _mm_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 2, 1)); // y0 z0 y1 z1
  const __m128 xy = _mm_shuffle_ps(b, c, _MM_SHUFFLE(2, 1, 3, 2)); // x2 y2 x3 y3
  return {_mm_shuffle_ps(a, xy, _MM_SHUFFLE(2, 0, 3, 0)), _mm_shuffle_ps(yz, xy, _MM_SHUFFLE(3, 1, 2, 0)),
          _mm_shuffle_ps(yz, c, _MM_SHUFFLE(3, 0, 3, 1))};
}
inline DoubleTriples loadTriples(const float* from) {
  const FourTriples low = loadFourTriples(from), high = loadFourTriples(from + 12);
  return {{_mm256_cvtps_pd(low.x), _mm256_cvtps_pd(high.x)},
          {_mm256_cvtps_pd(low.y), _mm256_cvtps_pd(high.y)},
          {_mm256_cvtps_pd(low.z), _mm256_cvtps_pd(high.z)}};
}
// And back.
inline void storeFourTriples(float* to, __m128 x, __m128 y, __m128 z) {
  const __m128 xy = _mm_shuffle_ps(x, y, _MM_SHUFFLE(2, 0, 2, 0)); // x0 x2 y0 y2
  const __m128 yz = _mm_shuffle_ps(y, z, _MM_SHUFFLE(3, 1, 3, 1)); // y1 y3 z1 z3
  const __m128 zx = _mm_shuffle_ps(z, x, _MM_SHUFFLE(3, 1, 2, 0)); // z0 z2 x1 x3
  _mm_storeu_ps(to, _mm_shuffle_ps(xy, zx, _MM_SHUFFLE(2, 0, 2, 0)));
  _mm_storeu_ps(to + 4, _mm_shuffle_ps(yz, xy, _MM_SHUFFLE(3, 1, 2, 0)));
  _mm_storeu_ps(to + 8, _mm_shuffle_ps(zx, yz, _MM_SHUFFLE(3, 1, 3, 1)));
}
inline void storeTriples(float* to, const DoubleTriples& t) {
  storeFourTriples(to, _mm256_cvtpd_ps(t.x.a), _mm256_cvtpd_ps(t.y.a), _mm256_cvtpd_ps(t.z.a));
  storeFourTriples(to + 12, _mm256_cvtpd_ps(t.x.b), _mm256_cvtpd_ps(t.y.b), _mm256_cvtpd_ps(t.z.b));
}

} // namespace
} // namespace surflect

#endif
