// lanes_scalar.h in AVX-512.
#pragma once

#ifdef __AVX512F__
#include <immintrin.h>

#include <cstdint>

namespace surflect {
namespace {

struct Lanes {
  __m512 v;
};
struct Mask {
  __mmask16 bits;
};

inline Lanes load(const float* from) { return {_mm512_loadu_ps(from)}; }
inline Lanes loadColumn(const float* from) {
  const __m512i rows =
      _mm512_setr_epi32(0, 16, 32, 48, 64, 80, 96, 112, 128, 144, 160, 176, 192, 208, 224, 240);
  return {_mm512_i32gather_ps(rows, from, 4)};
}
inline Lanes broadcast(float x) { return {_mm512_set1_ps(x)}; }
inline void store(float* to, Lanes a) { _mm512_storeu_ps(to, a.v); }
inline Lanes operator+(Lanes a, Lanes b) { return {_mm512_add_ps(a.v, b.v)}; }
inline Lanes operator-(Lanes a, Lanes b) { return {_mm512_sub_ps(a.v, b.v)}; }
inline Lanes operator*(Lanes a, Lanes b) { return {_mm512_mul_ps(a.v, b.v)}; }
inline Lanes operator/(Lanes a, Lanes b) { return {_mm512_div_ps(a.v, b.v)}; }
inline Lanes mulAdd(Lanes a, Lanes b, Lanes c) { return {_mm512_fmadd_ps(a.v, b.v, c.v)}; }
inline Lanes negMulAdd(Lanes a, Lanes b, Lanes c) { return {_mm512_fnmadd_ps(a.v, b.v, c.v)}; }
inline Lanes min(Lanes a, Lanes b) { return {_mm512_min_ps(a.v, b.v)}; }
inline Lanes max(Lanes a, Lanes b) { return {_mm512_max_ps(a.v, b.v)}; }
inline Lanes sqrt(Lanes a) { return {_mm512_sqrt_ps(a.v)}; }
inline Lanes ceil(Lanes a) { return {_mm512_roundscale_ps(a.v, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC)}; }
inline Lanes nearestWhole(Lanes a) {
  return {_mm512_roundscale_ps(a.v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)};
}
inline Lanes timesPowerOfTwo(Lanes a, Lanes power) { return {_mm512_scalef_ps(a.v, power.v)}; }
inline Mask operator<(Lanes a, Lanes b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)}; }
inline Mask operator<=(Lanes a, Lanes b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)}; }
inline Mask operator&(Mask a, Mask b) { return {_kand_mask16(a.bits, b.bits)}; }
inline Mask andNot(Mask a, Mask b) { return {_kandn_mask16(b.bits, a.bits)}; }
inline uint32_t bitsOf(Mask m) { return m.bits; }
inline Lanes select(Mask m, Lanes a, Lanes b) { return {_mm512_mask_blend_ps(m.bits, b.v, a.v)}; }
inline Lanes where(Mask m, Lanes a) { return {_mm512_maskz_mov_ps(m.bits, a.v)}; }
inline Lanes addWhere(Mask m, Lanes a, Lanes b) { return {_mm512_mask_add_ps(a.v, m.bits, a.v, b.v)}; }
inline Lanes minWhere(Mask m, Lanes a, Lanes b) { return {_mm512_mask_min_ps(a.v, m.bits, a.v, b.v)}; }
inline Lanes maxWhere(Mask m, Lanes a, Lanes b) { return {_mm512_mask_max_ps(a.v, m.bits, a.v, b.v)}; }
inline void storeCompressed(float* to, Mask m, Lanes a) {
  _mm512_storeu_ps(to, _mm512_maskz_compress_ps(m.bits, a.v)); // the form that stores by mask is slow
}

} // namespace
} // namespace surflect

#endif
