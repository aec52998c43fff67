// Vectors and 3 x 3 matrices in double precision, one point a lane. For kernels over Highway: included once
// for each instruction set.
#if defined(SURFEL_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SURFEL_VECTORS_INL_H
#undef SURFEL_VECTORS_INL_H
#else
#define SURFEL_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace surflect {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DoubleTag = hn::CappedTag<double, 8>;
using FloatTag = hn::Rebind<float, DoubleTag>; // as many floats
using Doubles = hn::Vec<DoubleTag>;
constexpr DoubleTag kDoubles;
constexpr FloatTag kFloats;
constexpr int kDoubleLanes = static_cast<int>(hn::MaxLanes(DoubleTag()));

// Arithmetic of a number, the same in each lane, with a vector: equations then read as on paper.
HWY_INLINE Doubles number(double x) { return hn::Set(kDoubles, x); }
HWY_INLINE Doubles operator+(double a, Doubles b) { return number(a) + b; }
HWY_INLINE Doubles operator-(double a, Doubles b) { return number(a) - b; }
HWY_INLINE Doubles operator*(double a, Doubles b) { return number(a) * b; }
HWY_INLINE Doubles operator/(double a, Doubles b) { return number(a) / b; }

// Bit i is that of lane i.
HWY_INLINE uint32_t bitsOf(hn::Mask<DoubleTag> mask) {
  uint8_t bits[8];
  hn::StoreMaskBits(kDoubles, mask, bits);
  return bits[0];
}

// Rounds to float; infinite beyond the range of floats.
HWY_INLINE hn::Vec<FloatTag> rounded(Doubles x) {
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128 // where DemoteTo stops at the largest float
  double from[kDoubleLanes];
  float to[kDoubleLanes];
  hn::StoreU(x, kDoubles, from);
  for (int i = 0; i < kDoubleLanes; ++i) to[i] = static_cast<float>(from[i]);
  return hn::LoadU(kFloats, to);
#else
  return hn::DemoteTo(kFloats, x);
#endif
}

struct Vector {
  Doubles x, y, z;
};
HWY_INLINE Vector vectorOf(const double* v) { return {number(v[0]), number(v[1]), number(v[2])}; }
HWY_INLINE Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
HWY_INLINE Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
HWY_INLINE Vector operator*(Doubles s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
HWY_INLINE Vector operator*(double s, const Vector& a) { return number(s) * a; }
// s a + b
HWY_INLINE Vector mulAdd(Doubles s, const Vector& a, const Vector& b) {
  return {MulAdd(s, a.x, b.x), MulAdd(s, a.y, b.y), MulAdd(s, a.z, b.z)};
}
HWY_INLINE Doubles dot(const Vector& a, const Vector& b) {
  return MulAdd(a.x, b.x, MulAdd(a.y, b.y, a.z * b.z));
}
HWY_INLINE Vector cross(const Vector& a, const Vector& b) {
  return {NegMulAdd(a.z, b.y, a.y * b.z), NegMulAdd(a.x, b.z, a.z * b.x), NegMulAdd(a.y, b.x, a.x * b.y)};
}

// 3 x 3 matrix with columns x, y, z.
struct Matrix {
  Vector x, y, z;
};
HWY_INLINE Vector operator*(const Matrix& m, const Vector& v) {
  return mulAdd(v.x, m.x, mulAdd(v.y, m.y, v.z * m.z));
}

// Three floats a lane: x y z x y z ...
HWY_INLINE Vector loadTriples(const float* from) {
  hn::Vec<FloatTag> x, y, z;
  hn::LoadInterleaved3(kFloats, from, x, y, z);
  return {hn::PromoteTo(kDoubles, x), hn::PromoteTo(kDoubles, y), hn::PromoteTo(kDoubles, z)};
}
HWY_INLINE void storeTriples(float* to, const Vector& v) {
  hn::StoreInterleaved3(rounded(v.x), rounded(v.y), rounded(v.z), kFloats, to);
}

// The first columns of rotationOf(r) (cloud.h), to the bit. The third number of r is 0 or 1.
struct RestFrame {
  Vector u, v;
};
HWY_INLINE RestFrame restFrame(const Vector& r) {
  const Doubles c = 2 / (1 + r.x * r.x + r.y * r.y);
  const Doubles half = 1 - 2 * r.z; // -1 in the lower hemisphere
  const Doubles cxy = c * r.x * r.y;
  return {{1 - c * r.y * r.y, half * cxy, half * (0 - c * r.y)},
          {cxy, half * (1 - c * r.x * r.x), half * (c * r.x)}};
}

} // namespace HWY_NAMESPACE
} // namespace surflect
HWY_AFTER_NAMESPACE();

#endif
