// lanes_scalar.h in AVX2 and FMA, as two halves.
#pragma once

#ifdef __AVX2__
#include <immintrin.h>

#include <cstdint>

namespace surflect {
namespace {

struct Lanes {
  __m256 a, b;
};
struct Mask { // all bits of a lane or none
  __m256 a, b;
};

inline Lanes load(const float* from) { return {_mm256_loadu_ps(from), _mm256_loadu_ps(from + 8)}; }
inline Lanes loadColumn(const float* from) {
  const __m256i rows = _mm256_setr_epi32(0, 16, 32, 48, 64, 80, 96, 112);
  return {_mm256_i32gather_ps(from, rows, 4), _mm256_i32gather_ps(from + 128, rows, 4)};
}
inline Lanes broadcast(float x) { return {_mm256_set1_ps(x), _mm256_set1_ps(x)}; }
inline void store(float* to, Lanes x) {
  _mm256_storeu_ps(to, x.a);
  _mm256_storeu_ps(to + 8, x.b);
}
inline Lanes operator+(Lanes x, Lanes y) { return {_mm256_add_ps(x.a, y.a), _mm256_add_ps(x.b, y.b)}; }
inline Lanes operator-(Lanes x, Lanes y) { return {_mm256_sub_ps(x.a, y.a), _mm256_sub_ps(x.b, y.b)}; }
inline Lanes operator*(Lanes x, Lanes y) { return {_mm256_mul_ps(x.a, y.a), _mm256_mul_ps(x.b, y.b)}; }
inline Lanes operator/(Lanes x, Lanes y) { return {_mm256_div_ps(x.a, y.a), _mm256_div_ps(x.b, y.b)}; }
inline Lanes mulAdd(Lanes x, Lanes y, Lanes z) {
  return {_mm256_fmadd_ps(x.a, y.a, z.a), _mm256_fmadd_ps(x.b, y.b, z.b)};
}
inline Lanes negMulAdd(Lanes x, Lanes y, Lanes z) {
  return {_mm256_fnmadd_ps(x.a, y.a, z.a), _mm256_fnmadd_ps(x.b, y.b, z.b)};
}
inline Lanes min(Lanes x, Lanes y) { return {_mm256_min_ps(x.a, y.a), _mm256_min_ps(x.b, y.b)}; }
inline Lanes max(Lanes x, Lanes y) { return {_mm256_max_ps(x.a, y.a), _mm256_max_ps(x.b, y.b)}; }
inline Lanes sqrt(Lanes x) { return {_mm256_sqrt_ps(x.a), _mm256_sqrt_ps(x.b)}; }
inline Lanes ceil(Lanes x) { return {_mm256_ceil_ps(x.a), _mm256_ceil_ps(x.b)}; }
inline Lanes nearestWhole(Lanes x) {
  constexpr int nearest = _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC;
  return {_mm256_round_ps(x.a, nearest), _mm256_round_ps(x.b, nearest)};
}
inline Lanes timesPowerOfTwo(Lanes x, Lanes power) {
  const auto half = [](__m256 of, __m256 by) {
    const __m256i exponent = _mm256_slli_epi32(_mm256_cvtps_epi32(by), 23);
    return _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(of), exponent));
  };
  return {half(x.a, power.a), half(x.b, power.b)};
}
inline Mask operator<(Lanes x, Lanes y) {
  return {_mm256_cmp_ps(x.a, y.a, _CMP_LT_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LT_OQ)};
}
inline Mask operator<=(Lanes x, Lanes y) {
  return {_mm256_cmp_ps(x.a, y.a, _CMP_LE_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LE_OQ)};
}
inline Mask operator&(Mask x, Mask y) { return {_mm256_and_ps(x.a, y.a), _mm256_and_ps(x.b, y.b)}; }
inline Mask andNot(Mask x, Mask y) { return {_mm256_andnot_ps(y.a, x.a), _mm256_andnot_ps(y.b, x.b)}; }
inline uint32_t bitsOf(Mask m) {
  return static_cast<uint32_t>(_mm256_movemask_ps(m.a)) | static_cast<uint32_t>(_mm256_movemask_ps(m.b)) << 8;
}
inline Lanes select(Mask m, Lanes x, Lanes y) {
  return {_mm256_blendv_ps(y.a, x.a, m.a), _mm256_blendv_ps(y.b, x.b, m.b)};
}
inline Lanes where(Mask m, Lanes x) { return {_mm256_and_ps(m.a, x.a), _mm256_and_ps(m.b, x.b)}; }
inline Lanes addWhere(Mask m, Lanes x, Lanes y) {
  return {_mm256_add_ps(x.a, _mm256_and_ps(m.a, y.a)), _mm256_add_ps(x.b, _mm256_and_ps(m.b, y.b))};
}
inline Lanes minWhere(Mask m, Lanes x, Lanes y) { return select(m, min(x, y), x); }
inline Lanes maxWhere(Mask m, Lanes x, Lanes y) { return select(m, max(x, y), x); }

// For each set of eight lanes, which lane goes where: those of the set first.
struct CompressedOrders {
  alignas(64) uint8_t lanes[256][8] = {};
  constexpr CompressedOrders() {
    for (int set = 0; set < 256; ++set) {
      int n = 0;
      for (int lane = 0; lane < 8; ++lane)
        if (set >> lane & 1) lanes[set][n++] = static_cast<uint8_t>(lane);
    }
  }
};
constexpr CompressedOrders compressedOrders;
inline __m256 compressed(__m256 x, uint32_t set) {
  const __m128i bytes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(compressedOrders.lanes[set]));
  return _mm256_permutevar8x32_ps(x, _mm256_cvtepu8_epi32(bytes));
}
inline void storeCompressed(float* to, Mask m, Lanes x) {
  const auto low = static_cast<uint32_t>(_mm256_movemask_ps(m.a)),
             high = static_cast<uint32_t>(_mm256_movemask_ps(m.b));
  _mm256_storeu_ps(to, compressed(x.a, low));
  _mm256_storeu_ps(to + __builtin_popcount(low), compressed(x.b, high));
}

} // namespace
} // namespace surflect

#endif
