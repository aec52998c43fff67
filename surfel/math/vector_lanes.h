// Eight vectors at a time, and the tangent frames at rest. For the sources of kernels alone, see simd.h.
#pragma once

#include "surfel/math/double_lanes.h"

namespace surflect {
namespace {

using Vector = DoubleTriples;

inline Vector vectorOf(const double* v) { return {v[0], v[1], v[2]}; }
inline Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator*(DoubleLanes s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
// s a + b
inline Vector mulAdd(DoubleLanes s, const Vector& a, const Vector& b) {
  return {mulAdd(s, a.x, b.x), mulAdd(s, a.y, b.y), mulAdd(s, a.z, b.z)};
}
inline DoubleLanes dot(const Vector& a, const Vector& b) {
  return mulAdd(a.x, b.x, mulAdd(a.y, b.y, a.z * b.z));
}
inline Vector cross(const Vector& a, const Vector& b) {
  return {minusProduct(a.y * b.z, a.z, b.y), minusProduct(a.z * b.x, a.x, b.z),
          minusProduct(a.x * b.y, a.y, b.x)};
}

// Three by three numbers, by columns.
struct Matrix {
  Vector x, y, z;
};
inline Vector operator*(const Matrix& m, const Vector& v) {
  return mulAdd(v.x, m.x, mulAdd(v.y, m.y, v.z * m.z));
}

struct RestFrame {
  Vector u, v;
};
// The first columns of rotationOf(r) (frame.h), to the bit. The third number of r is 0 or 1.
inline RestFrame restFrame(const Vector& r) {
  const DoubleLanes c = 2 / (1 + r.x * r.x + r.y * r.y);
  const DoubleLanes half = 1 - 2 * r.z; // -1 in the lower hemisphere
  const DoubleLanes cxy = c * r.x * r.y;
  return {{1 - c * r.y * r.y, half * cxy, half * (0 - c * r.y)},
          {cxy, half * (1 - c * r.x * r.x), half * (c * r.x)}};
}

} // namespace
} // namespace surflect
