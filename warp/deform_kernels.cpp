#include "warp/deform_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "warp/deform_kernels.cpp"
#include <hwy/foreach_target.h>
// After it, for each instruction set.
#include "surfel/math/vectors-inl.h"
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::warp {
namespace HWY_NAMESPACE {

using namespace surflect::HWY_NAMESPACE; // vectors-inl.h
namespace {

// Symbols are those of warp.cpp and lattice.cpp, where each warp is written down for one point.
HWY_INLINE Vector loadVector(const double* x, const double* y, const double* z, int at) {
  return {hn::Load(kDoubles, x + at), hn::Load(kDoubles, y + at), hn::Load(kDoubles, z + at)};
}
HWY_INLINE void storeVector(double* x, double* y, double* z, int at, const Vector& v) {
  hn::Store(v.x, kDoubles, x + at);
  hn::Store(v.y, kDoubles, y + at);
  hn::Store(v.z, kDoubles, z + at);
}

// A group of points being warped, one per lane: positions, tangents, determinant of the Jacobian.
struct Carried {
  Vector x, u, v;
  Doubles determinant;
};
// Calls step(Carried&) for each group.
template <class Step> HWY_INLINE void carryEach(WarpBatch& b, const Step& step) {
  for (int at = 0; at < b.count; at += kDoubleLanes) {
    Carried c{loadVector(b.x, b.y, b.z, at), loadVector(b.ux, b.uy, b.uz, at),
              loadVector(b.vx, b.vy, b.vz, at), hn::Load(kDoubles, b.determinant + at)};
    step(c);
    storeVector(b.x, b.y, b.z, at, c.x);
    storeVector(b.ux, b.uy, b.uz, at, c.u);
    storeVector(b.vx, b.vy, b.vz, at, c.v);
    hn::Store(c.determinant, kDoubles, b.determinant + at);
  }
}

// Loads the first `count` triples; the other lanes are 0.
HWY_INLINE Vector takeTriples(const float* from, int count) {
  float padded[3 * kDoubleLanes];
  if (count < kDoubleLanes) {
    for (int i = 0; i < 3 * kDoubleLanes; ++i) padded[i] = i < 3 * count ? from[i] : 0;
    from = padded;
  }
  return loadTriples(from);
}

void beginBatch(const float* p0, const float* r0, int count, WarpBatch& b) {
  b.count = count;
  for (int at = 0; at < count; at += kDoubleLanes) {
    storeVector(b.x, b.y, b.z, at, takeTriples(p0 + 3 * at, count - at));
    const RestFrame rest = restFrame(takeTriples(r0 + 3 * at, count - at));
    storeVector(b.ux, b.uy, b.uz, at, rest.u);
    storeVector(b.vx, b.vy, b.vz, at, rest.v);
    hn::Store(number(1), kDoubles, b.determinant + at);
  }
}

void carryAffine(const double* linear, const double* offset, double determinant, WarpBatch& b) {
  const Matrix j{vectorOf(linear), vectorOf(linear + 3), vectorOf(linear + 6)};
  const Vector shift = vectorOf(offset);
  carryEach(b, [&](Carried& c) HWY_ATTR {
    c.x = j * c.x + shift;
    c.u = j * c.u;
    c.v = j * c.v;
    c.determinant = determinant * c.determinant;
  });
}

// Sine and cosine within 4e-13; without fused multiplication within 2^-52 |phi| beside. Beyond 2^50 a phi has
// no digits that say a direction, and is taken as 0. hn::Sin and hn::Cos hold up to 39000 radians only, and
// take twice the time for digits that are not needed here. The polynomials interpolate at Chebyshev's nodes.
struct Turned {
  Doubles sine, cosine;
  Doubles versine; // 1 - cosine, to its own precision where it is small
};
HWY_INLINE Turned turnedBy(Doubles phi) {
  phi = IfThenElse(Abs(phi) < number(0x1p50), phi, 0 * phi);
  // phi = quarters pi/2 + r, |r| <= pi/4
  const Doubles quarters = Round(phi * number(0.63661977236758134308));
  const Doubles r = NegMulAdd(quarters, number(0x1.1a62633145c07p-54),
                              NegMulAdd(quarters, number(0x1.921fb54442d18p+0), phi));
  const Doubles z = r * r;
  // (sin r / r - 1) / r^2, within 2.8e-14
  Doubles s = MulAdd(z, number(-2.4805635773967188e-8), number(2.7555990924514209e-6));
  s = MulAdd(z, s, number(-0.00019841266916969272));
  s = MulAdd(z, s, number(0.0083333333310792059));
  s = MulAdd(z, s, number(-0.16666666666663886));
  const Doubles sine = MulAdd(r * z, s, r);
  // (1 - cos r) / r^2, within 3.7e-13
  Doubles c = MulAdd(z, number(2.72371398106818e-7), number(-2.4799862183591496e-5));
  c = MulAdd(z, c, number(0.0013888885091377527));
  c = MulAdd(z, c, number(-0.04166666663739585));
  c = MulAdd(z, c, number(0.49999999999963891));
  const Doubles versine = z * c, cosine = 1 - versine;
  // q = quarters mod 4, of -2 to 2; (even, odd) = (cos, sin) of q pi/2: one is 0, the other 1 or -1.
  const Doubles q = MulAdd(Round(0.25 * quarters), number(-4), quarters);
  const Doubles even = 1 - Abs(q), odd = q * (2 - Abs(q));
  return {MulAdd(even, sine, odd * cosine), NegMulAdd(odd, sine, even * cosine),
          MulAdd(even, versine, MulAdd(odd, sine, 1 - even))};
}

// e^x, x taken as of -700 or 700 where it is less or more: hn::Exp holds to 706.
HWY_INLINE Doubles exponential(Doubles x) {
  return hn::Exp(kDoubles, Min(number(700), Max(number(-700), x)));
}

// R = I + sin(k h) [a]x + (1 - cos(k h)) (a a^T - I). det J = 1.
void carryTwist(const double* axis, double k, const double* center, WarpBatch& b) {
  const Vector a = vectorOf(axis), ka = k * a, middle = vectorOf(center);
  const double xx = axis[0] * axis[0] - 1, yy = axis[1] * axis[1] - 1, zz = axis[2] * axis[2] - 1;
  const double xy = axis[0] * axis[1], yz = axis[1] * axis[2], zx = axis[2] * axis[0];
  carryEach(b, [&](Carried& c) HWY_ATTR {
    const Vector y = c.x - middle;
    const Turned turned = turnedBy(dot(ka, y));
    const Vector s = turned.sine * a;
    const Doubles t = turned.versine, txy = xy * t, tyz = yz * t, tzx = zx * t;
    const Matrix r{{MulAdd(t, number(xx), number(1)), txy + s.z, tzx - s.y},
                   {txy - s.z, MulAdd(t, number(yy), number(1)), tyz + s.x},
                   {tzx + s.y, tyz - s.x, MulAdd(t, number(zz), number(1))}};
    const Vector ry = r * y, slope = cross(ka, ry);
    const Matrix j{mulAdd(a.x, slope, r.x), mulAdd(a.y, slope, r.y), mulAdd(a.z, slope, r.z)};
    c.x = middle + ry;
    c.u = j * c.u;
    c.v = j * c.v;
  });
}

// In the plane of a and d, from (h, w):  (sin(phi)/k - w sin(phi), (1 - cos(phi))/k + w cos(phi)); across it
// nothing moves. det J = 1 - k w.
void carryBend(const double* axis, const double* direction, double k, const double* center, WarpBatch& b) {
  const Vector a = vectorOf(axis), d = vectorOf(direction), middle = vectorOf(center);
  const double radius = 1 / k;
  carryEach(b, [&](Carried& c) HWY_ATTR {
    const Vector y = c.x - middle;
    const Doubles h = dot(a, y), w = dot(d, y), stretch = 1 - k * w;
    const Turned turned = turnedBy(k * h);
    const auto moved = [&](const Vector& from, Doubles alongA, Doubles alongD)
                           HWY_ATTR { return mulAdd(alongA, a, mulAdd(alongD, d, from)); };
    const auto tangent = [&](const Vector& t) HWY_ATTR {
      const Doubles ta = dot(a, t), td = dot(d, t), sa = stretch * ta;
      return moved(t, sa * turned.cosine - td * turned.sine - ta, sa * turned.sine + td * turned.cosine - td);
    };
    c.x = moved(c.x, (radius - w) * turned.sine - h, (radius - w) * turned.versine);
    c.u = tangent(c.u);
    c.v = tangent(c.v);
    c.determinant = c.determinant * stretch;
  });
}

// det J = s^2.
void carryTaper(const double* axis, double g, const double* center, WarpBatch& b) {
  const Vector a = vectorOf(axis), middle = vectorOf(center);
  carryEach(b, [&](Carried& c) HWY_ATTR {
    const Vector y = c.x - middle;
    const Doubles h = dot(a, y), s = exponential(g * h);
    const Vector across = s * (y - h * a);
    const auto tangent = [&](const Vector& d) HWY_ATTR {
      const Doubles along = dot(a, d);
      return along * mulAdd(number(g), across, a) + s * (d - along * a);
    };
    c.x = middle + mulAdd(h, a, across);
    c.u = tangent(c.u);
    c.v = tangent(c.v);
    c.determinant = c.determinant * (s * s);
  });
}

// det J = 1 + A q cos(phi) (a . d).
void carrySine(const double* axis, const double* direction, const double* center, double amplitude, double q,
               double phase, WarpBatch& b) {
  const Vector a = vectorOf(axis), d = vectorOf(direction), middle = vectorOf(center);
  carryEach(b, [&](Carried& c) HWY_ATTR {
    const Turned turned = turnedBy(MulAdd(number(q), dot(a, c.x - middle), number(phase)));
    const Doubles slope = (amplitude * q) * turned.cosine;
    c.x = mulAdd(amplitude * turned.sine, d, c.x);
    c.u = mulAdd(slope * dot(a, c.u), d, c.u);
    c.v = mulAdd(slope * dot(a, c.v), d, c.v);
    c.determinant = c.determinant * MulAdd(slope, dot(a, d), number(1));
  });
}

// A polynomial with vectors for coefficients, and its derivative, at one place, by Horner's rule.
struct Horner {
  Vector value, slope;
  // Takes the coefficients in turn, the highest power's first; there are at least two.
  HWY_INLINE void take(int index, Doubles place, const Vector& coefficient) {
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
  Doubles inside, beyond;
};
HWY_INLINE Place placeOf(Doubles s, Doubles half) {
  const Doubles inside = Min(half, Max(0 - half, s));
  return {inside, s - inside};
}

// Displacement of one place by the control points, and its derivatives over s, t, u. A place beyond the box
// is displaced along the tangent at the nearest place of the box; `anyBeyond` says whether any lane is there.
// The other lanes keep their bits, since a product by 0 is added to sums that are never -0. kDegree, unless
// it is 0, is the degree over every axis, which gives loops a constant length.
struct LatticeMove {
  Vector move, overS, overT, overU;
};
template <bool anyBeyond, int kDegree>
HWY_INLINE LatticeMove latticeMove(const LatticeStep& l, Place s, Place t, Place u) {
  const auto degree = [&](int axis) HWY_ATTR { return kDegree > 0 ? kDegree : l.divisions[axis]; };
  const auto onward = [](const Horner& h, const Place& p)
                          HWY_ATTR { return anyBeyond ? mulAdd(p.beyond, h.slope, h.value) : h.value; };
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

template <int kDegree> HWY_INLINE void latticeOf(const LatticeStep& given, WarpBatch& batch) {
  const LatticeStep step = given;
  const Vector middle = vectorOf(step.middle), half = vectorOf(step.half);
  carryEach(batch, [&](Carried& c) HWY_ATTR {
    const Vector from = c.x - middle;
    const Place s = placeOf(from.x, half.x), t = placeOf(from.y, half.y), u = placeOf(from.z, half.z);
    const Doubles beyond = Max(Abs(s.beyond), Max(Abs(t.beyond), Abs(u.beyond)));
    const LatticeMove sum = hn::AllFalse(kDoubles, number(0) < beyond)
                                ? latticeMove<false, kDegree>(step, s, t, u)
                                : latticeMove<true, kDegree>(step, s, t, u);
    // J = I + gradient
    const Vector &gs = sum.overS, &gt = sum.overT, &gu = sum.overU;
    const Matrix j{{1 + gs.x, gs.y, gs.z}, {gt.x, 1 + gt.y, gt.z}, {gu.x, gu.y, 1 + gu.z}};
    c.x = c.x + sum.move;
    c.u = j * c.u;
    c.v = j * c.v;
    c.determinant = c.determinant * dot(cross(j.x, j.y), j.z);
  });
}

void carryLattice(const LatticeStep& step, WarpBatch& batch) {
  if (step.divisions[0] == 3 && step.divisions[1] == 3 && step.divisions[2] == 3)
    latticeOf<3>(step, batch);
  else
    latticeOf<0>(step, batch);
}

// polarFrame needs |u x v| > 8 2^-23 max(u . u, v . v) in float. Four times that is enough for tangents
// before they are rounded, where these neither overflow nor lose digits.
HWY_INLINE hn::Mask<DoubleTag> hasFrame(const Vector& u, const Vector& v) {
  const double slender = 0x1p-18 * 0x1p-18, overflow = 0x1p+127 * 0x1p+127, underflow = 0x1p-105 * 0x1p-105;
  const Vector normal = cross(u, v);
  const Doubles most = Max(dot(u, u), dot(v, v));
  return And(slender * most * most < dot(normal, normal),
             And(number(underflow) < most, most < number(overflow)));
}

void finishBatch(const WarpBatch& b, float* p, float* u, float* v, int8_t* handedness, uint32_t* doubtful) {
  const hn::Rebind<int32_t, DoubleTag> kInts;
  const hn::Rebind<int8_t, DoubleTag> kBytes;
  for (int i = 0; i < WarpBatch::capacity / 32; ++i) doubtful[i] = 0;
  for (int at = 0; at < b.count; at += kDoubleLanes) {
    const Vector x = loadVector(b.x, b.y, b.z, at), U = loadVector(b.ux, b.uy, b.uz, at),
                 V = loadVector(b.vx, b.vy, b.vz, at);
    const Doubles determinant = hn::Load(kDoubles, b.determinant + at);
    storeTriples(p + 3 * at, x);
    storeTriples(u + 3 * at, U);
    storeTriples(v + 3 * at, V);
    const Doubles finite =
        MulAdd(determinant, number(0), dot(x, x)); // not a number if the determinant is not
    const uint32_t sure = bitsOf(And(hasFrame(U, V), finite < number(0x1p+127 * 0x1p+127)));
    doubtful[at / 32] |= (~sure & ((1u << kDoubleLanes) - 1)) << at % 32;
    const Doubles sign = IfThenElse(determinant < number(0), number(-1), number(1));
    hn::StoreU(hn::DemoteTo(kBytes, hn::DemoteTo(kInts, sign)), kBytes, handedness + at);
  }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::warp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::warp {

HWY_EXPORT(beginBatch);
void beginBatch(const float* p0, const float* r0, int count, WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(beginBatch)(p0, r0, count, batch);
}

HWY_EXPORT(carryAffine);
void carryAffine(const double* linear, const double* offset, double determinant, WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(carryAffine)(linear, offset, determinant, batch);
}

HWY_EXPORT(carryTwist);
void carryTwist(const double* axis, double k, const double* center, WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(carryTwist)(axis, k, center, batch);
}

HWY_EXPORT(carryBend);
void carryBend(const double* axis, const double* direction, double k, const double* center,
               WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(carryBend)(axis, direction, k, center, batch);
}

HWY_EXPORT(carryTaper);
void carryTaper(const double* axis, double g, const double* center, WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(carryTaper)(axis, g, center, batch);
}

HWY_EXPORT(carrySine);
void carrySine(const double* axis, const double* direction, const double* center, double amplitude, double q,
               double phase, WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(carrySine)(axis, direction, center, amplitude, q, phase, batch);
}

HWY_EXPORT(carryLattice);
void carryLattice(const LatticeStep& step, WarpBatch& batch) {
  HWY_DYNAMIC_DISPATCH(carryLattice)(step, batch);
}

HWY_EXPORT(finishBatch);
void finishBatch(const WarpBatch& batch, float* p, float* u, float* v, int8_t* handedness,
                 uint32_t* doubtful) {
  HWY_DYNAMIC_DISPATCH(finishBatch)(batch, p, u, v, handedness, doubtful);
}

} // namespace surflect::warp
#endif
