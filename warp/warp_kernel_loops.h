// The loops of warp_kernels.h, in the lanes that the compiler was told to use. Symbols are those of warp.cpp
// and lattice.cpp, where each warp is written down for one point.
#pragma once

#include "surfel/math/vector_lanes.h"
#include "warp/warp_functions.h"
#include "warp/warp_kernels.h"

namespace surflect::warp {
namespace {

inline Vector loadVector(const double* x, const double* y, const double* z, int at) {
  return {load(x + at), load(y + at), load(z + at)};
}
inline void storeVector(double* x, double* y, double* z, int at, const Vector& v) {
  store(x + at, v.x);
  store(y + at, v.y);
  store(z + at, v.z);
}

// A group of points on its way.
struct Carried {
  Vector x, u, v;
  DoubleLanes determinant;
};
// Calls step(Carried&) for each group.
template <class Step> inline void carryEach(WarpBatch& b, const Step& step) {
  for (int at = 0; at < b.count; at += kWarpGroup) {
    Carried c{loadVector(b.x, b.y, b.z, at), loadVector(b.ux, b.uy, b.uz, at),
              loadVector(b.vx, b.vy, b.vz, at), load(b.determinant + at)};
    step(c);
    storeVector(b.x, b.y, b.z, at, c.x);
    storeVector(b.ux, b.uy, b.uz, at, c.u);
    storeVector(b.vx, b.vy, b.vz, at, c.v);
    store(b.determinant + at, c.determinant);
  }
}

// Eight triples of which the first `count` are there, the others 0.
inline Vector takeTriples(const float* from, int count) {
  float padded[3 * kWarpGroup];
  if (count < kWarpGroup) {
    for (int i = 0; i < 3 * kWarpGroup; ++i) padded[i] = i < 3 * count ? from[i] : 0;
    from = padded;
  }
  return loadTriples(from);
}

void begin(const float* p0, const float* r0, int count, WarpBatch& b) {
  b.count = count;
  for (int at = 0; at < count; at += kWarpGroup) {
    storeVector(b.x, b.y, b.z, at, takeTriples(p0 + 3 * at, count - at));
    const RestFrame rest = restFrame(takeTriples(r0 + 3 * at, count - at));
    storeVector(b.ux, b.uy, b.uz, at, rest.u);
    storeVector(b.vx, b.vy, b.vz, at, rest.v);
    store(b.determinant + at, 1);
  }
}

void affine(const double* linear, const double* offset, double determinant, WarpBatch& b) {
  const Matrix j{vectorOf(linear), vectorOf(linear + 3), vectorOf(linear + 6)};
  const Vector shift = vectorOf(offset);
  carryEach(b, [&](Carried& c) {
    c.x = j * c.x + shift;
    c.u = j * c.u;
    c.v = j * c.v;
    c.determinant = determinant * c.determinant;
  });
}

// R = I + sin(k h) [a]x + (1 - cos(k h)) (a a^T - I). det J = 1.
void twist(const double* axis, double k, const double* center, WarpBatch& b) {
  const Vector a = vectorOf(axis), ka = k * a, middle = vectorOf(center);
  const double xx = axis[0] * axis[0] - 1, yy = axis[1] * axis[1] - 1, zz = axis[2] * axis[2] - 1;
  const double xy = axis[0] * axis[1], yz = axis[1] * axis[2], zx = axis[2] * axis[0];
  carryEach(b, [&](Carried& c) {
    const Vector y = c.x - middle;
    const Turned turned = turnedBy(dot(ka, y));
    const Vector s = turned.sine * a;
    const DoubleLanes t = turned.versine, txy = t * xy, tyz = t * yz, tzx = t * zx;
    const Matrix r{{mulAdd(t, xx, 1), txy + s.z, tzx - s.y},
                   {txy - s.z, mulAdd(t, yy, 1), tyz + s.x},
                   {tzx + s.y, tyz - s.x, mulAdd(t, zz, 1)}};
    const Vector ry = r * y, slope = cross(ka, ry);
    const Matrix j{mulAdd(a.x, slope, r.x), mulAdd(a.y, slope, r.y), mulAdd(a.z, slope, r.z)};
    c.x = middle + ry;
    c.u = j * c.u;
    c.v = j * c.v;
  });
}

// In the plane of a and d, from (h, w):  (sin(phi)/k - w sin(phi), (1 - cos(phi))/k + w cos(phi)); across it
// nothing moves. det J = 1 - k w.
void bend(const double* axis, const double* direction, double k, const double* center, WarpBatch& b) {
  const Vector a = vectorOf(axis), d = vectorOf(direction), middle = vectorOf(center);
  const double radius = 1 / k;
  carryEach(b, [&](Carried& c) {
    const Vector y = c.x - middle;
    const DoubleLanes h = dot(a, y), w = dot(d, y), stretch = 1 - k * w;
    const Turned turned = turnedBy(k * h);
    const auto moved = [&](const Vector& from, DoubleLanes alongA, DoubleLanes alongD) {
      return mulAdd(alongA, a, mulAdd(alongD, d, from));
    };
    const auto tangent = [&](const Vector& t) {
      const DoubleLanes ta = dot(a, t), td = dot(d, t), sa = stretch * ta;
      return moved(t, sa * turned.cosine - td * turned.sine - ta, sa * turned.sine + td * turned.cosine - td);
    };
    c.x = moved(c.x, (radius - w) * turned.sine - h, (radius - w) * turned.versine);
    c.u = tangent(c.u);
    c.v = tangent(c.v);
    c.determinant = c.determinant * stretch;
  });
}

// det J = s^2.
void taper(const double* axis, double g, const double* center, WarpBatch& b) {
  const Vector a = vectorOf(axis), middle = vectorOf(center);
  carryEach(b, [&](Carried& c) {
    const Vector y = c.x - middle;
    const DoubleLanes h = dot(a, y), s = exponential(g * h);
    const Vector across = s * (y - h * a);
    const auto tangent = [&](const Vector& d) {
      const DoubleLanes along = dot(a, d);
      return along * mulAdd(g, across, a) + s * (d - along * a);
    };
    c.x = middle + mulAdd(h, a, across);
    c.u = tangent(c.u);
    c.v = tangent(c.v);
    c.determinant = c.determinant * (s * s);
  });
}

// det J = 1 + A q cos(phi) (a . d).
void sine(const double* axis, const double* direction, const double* center, double amplitude, double q,
          double phase, WarpBatch& b) {
  const Vector a = vectorOf(axis), d = vectorOf(direction), middle = vectorOf(center);
  carryEach(b, [&](Carried& c) {
    const Turned turned = turnedBy(mulAdd(q, dot(a, c.x - middle), phase));
    const DoubleLanes slope = amplitude * q * turned.cosine;
    c.x = mulAdd(amplitude * turned.sine, d, c.x);
    c.u = mulAdd(slope * dot(a, c.u), d, c.u);
    c.v = mulAdd(slope * dot(a, c.v), d, c.v);
    c.determinant = c.determinant * mulAdd(slope, dot(a, d), 1);
  });
}

// A polynomial with vectors for coefficients, and its derivative, at one place, by Horner's rule.
struct Horner {
  Vector value{0, 0, 0}, slope{0, 0, 0};
  // The coefficients in turn, the highest power's first.
  void take(int index, DoubleLanes place, const Vector& coefficient) {
    if (index == 0) {
      value = coefficient;
      return;
    }
    slope = index == 1 ? value : mulAdd(place, slope, value);
    value = mulAdd(place, value, coefficient);
  }
};
// A place along an axis of the box, cut off at its ends, and how far beyond them it was.
struct Place {
  DoubleLanes inside, beyond;
};
inline Place placeOf(DoubleLanes s, DoubleLanes half) {
  const DoubleLanes inside = min(half, max(0 - half, s));
  return {inside, s - inside};
}

// What the control points do to one place, and its derivatives over s, t, u. What is beyond the box goes on
// along the tangent there; `anyBeyond` says whether there is such a place. It does not change the others: a
// product by 0 is added to sums that are never -0. kDegree, unless it is 0, is the degree over every axis:
// loops then know how far they go.
struct LatticeMove {
  Vector move, overS, overT, overU;
};
template <bool anyBeyond, int kDegree>
inline LatticeMove latticeMove(const LatticeStep& l, Place s, Place t, Place u) {
  const auto degree = [&](int axis) { return kDegree > 0 ? kDegree : l.divisions[axis]; };
  const auto onward = [](const Horner& h, const Place& p) {
    return anyBeyond ? mulAdd(p.beyond, h.slope, h.value) : h.value;
  };
  Horner sum, sumOverS, sumOverT;
  const double* coefficient = l.coefficients;
  for (int k = 0; k <= degree(2); ++k) {
    Horner plane, planeOverS;
    for (int j = 0; j <= degree(1); ++j) {
      Horner row;
      for (int i = 0; i <= degree(0); ++i, coefficient += 3) row.take(i, s.inside, vectorOf(coefficient));
      plane.take(j, t.inside, onward(row, s));
      planeOverS.take(j, t.inside, row.slope);
    }
    sum.take(k, u.inside, onward(plane, t));
    sumOverS.take(k, u.inside, onward(planeOverS, t));
    sumOverT.take(k, u.inside, plane.slope);
  }
  return {onward(sum, u), onward(sumOverS, u), onward(sumOverT, u), sum.slope};
}

template <int kDegree> inline void latticeOf(const LatticeStep& given, WarpBatch& batch) {
  const LatticeStep step = given;
  const Vector middle = vectorOf(step.middle), half = vectorOf(step.half);
  carryEach(batch, [&](Carried& c) {
    const Vector from = c.x - middle;
    const Place s = placeOf(from.x, half.x), t = placeOf(from.y, half.y), u = placeOf(from.z, half.z);
    const DoubleLanes beyond = max(absolute(s.beyond), max(absolute(t.beyond), absolute(u.beyond)));
    const LatticeMove sum = bitsOfLess(0, beyond) != 0 ? latticeMove<true, kDegree>(step, s, t, u)
                                                       : latticeMove<false, kDegree>(step, s, t, u);
    // J = I + gradient
    const Vector &gs = sum.overS, &gt = sum.overT, &gu = sum.overU;
    const Matrix j{{1 + gs.x, gs.y, gs.z}, {gt.x, 1 + gt.y, gt.z}, {gu.x, gu.y, 1 + gu.z}};
    c.x = c.x + sum.move;
    c.u = j * c.u;
    c.v = j * c.v;
    c.determinant = c.determinant * dot(cross(j.x, j.y), j.z);
  });
}

void lattice(const LatticeStep& step, WarpBatch& batch) {
  if (step.divisions[0] == 3 && step.divisions[1] == 3 && step.divisions[2] == 3)
    latticeOf<3>(step, batch);
  else
    latticeOf<0>(step, batch);
}

// A byte of 1 for each of the eight bits that is set.
inline uint64_t bytesOfBits(uint32_t bits) {
  const uint64_t each = 0x0101010101010101, low7 = 0x7f7f7f7f7f7f7f7f;
  return (((bits * each & 0x8040201008040201) + low7) >> 7) & each;
}

void finish(const WarpBatch& b, float* p, float* u, float* v, int8_t* handedness, uint32_t* doubtful) {
  // polarFrame wants |u x v| > 8 2^-23 max(u . u, v . v), in float: four times that is sure, of tangents
  // before they are rounded, too, where these neither overflow nor lose digits. Of what is not a number max
  // keeps its second operand; in U or V that makes the normal none.
  const double slender = 0x1p-18 * 0x1p-18, overflow = 0x1p+127 * 0x1p+127, underflow = 0x1p-105 * 0x1p-105;
  for (int i = 0; i < WarpBatch::capacity / 32; ++i) doubtful[i] = 0;
  for (int at = 0; at < b.count; at += kWarpGroup) {
    const Vector x = loadVector(b.x, b.y, b.z, at), U = loadVector(b.ux, b.uy, b.uz, at),
                 V = loadVector(b.vx, b.vy, b.vz, at);
    const DoubleLanes determinant = load(b.determinant + at);
    storeTriples(p + 3 * at, x);
    storeTriples(u + 3 * at, U);
    storeTriples(v + 3 * at, V);

    const Vector normal = cross(U, V);
    const DoubleLanes most = max(dot(U, U), dot(V, V));
    const uint32_t sure = bitsOfLess(slender * most * most, dot(normal, normal)) &
                          bitsOfLess(underflow, most) &
                          bitsOfLess(max(most, mulAdd(determinant, 0, dot(x, x))), overflow);
    const uint32_t mirrored = bitsOfLess(determinant, 0);
    doubtful[at / 32] |= (~sure & 0xff) << at % 32;
    const uint64_t kept = bytesOfBits(~mirrored & 0xff), turned = bytesOfBits(mirrored);
    const uint64_t signs = kept | turned * 0xff;
    __builtin_memcpy(handedness + at, &signs, sizeof signs);
  }
}

constexpr WarpKernels kernelsOfTheseLanes{begin, affine, twist, bend, taper, sine, lattice, finish};

} // namespace
} // namespace surflect::warp
