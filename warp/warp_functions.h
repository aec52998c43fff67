// Sine, cosine and exponential in lanes. For the sources of kernels alone.
//
// The polynomials are near-minimax: interpolated at Chebyshev's nodes of the interval given, in 40 digits.
#pragma once

#include "surfel/math/double_lanes.h"

namespace surflect::warp {
namespace {

struct Turned {
  DoubleLanes sine, cosine;
  DoubleLanes versine; // 1 - cosine, to its own precision where it is small
};

// Within 4e-13 of the truth; scalar, which rounds quarters p1 before it subtracts, within 2^-52 |phi| beside.
// Beyond 2^50 a phi has no digits that say a direction, and any is given.
inline Turned turnedBy(DoubleLanes phi) {
  const double wide = 0x1p50;
  phi = min(wide, max(-wide, phi));
  // phi = quarters pi/2 + r, |r| <= pi/4; p1 + p2 is pi/2. Adding and subtracting 1.5 2^52 rounds.
  const double p1 = 0x1.921fb54442d18p+0, p2 = 0x1.1a62633145c07p-54, rounder = 0x1.8p52;
  const DoubleLanes quarters = (phi * 0.63661977236758134308 + rounder) - rounder;
  const DoubleLanes r = minusProduct(minusProduct(phi, quarters, p1), quarters, p2);
  const DoubleLanes z = r * r;
  // (sin r / r - 1) / r^2, within 2.8e-14
  DoubleLanes s = mulAdd(z, -2.4805635773967188e-8, 2.7555990924514209e-6);
  s = mulAdd(z, s, -0.00019841266916969272);
  s = mulAdd(z, s, 0.0083333333310792059);
  s = mulAdd(z, s, -0.16666666666663886);
  const DoubleLanes sine = mulAdd(r * z, s, r);
  // (1 - cos r) / r^2, within 3.7e-13
  DoubleLanes c = mulAdd(z, 2.72371398106818e-7, -2.4799862183591496e-5);
  c = mulAdd(z, c, 0.0013888885091377527);
  c = mulAdd(z, c, -0.04166666663739585);
  c = mulAdd(z, c, 0.49999999999963891);
  const DoubleLanes versine = z * c, cosine = 1 - versine;
  // q = quarters mod 4, of -2 to 2; (even, odd) = (cos, sin) of q pi/2: one is 0, the other 1 or -1.
  const DoubleLanes q = mulAdd((quarters * 0.25 + rounder) - rounder, -4, quarters);
  const DoubleLanes even = 1 - absolute(q), odd = q * (2 - absolute(q));
  return {mulAdd(even, sine, odd * cosine), minusProduct(even * cosine, odd, sine),
          mulAdd(even, versine, mulAdd(odd, sine, 1 - even))};
}

// e^x within 1e-12 of itself. Taken as of -256 or 256 where it is less or more.
inline DoubleLanes exponential(DoubleLanes x) {
  const DoubleLanes t = min(0.25, max(-0.25, x * 0x1p-10));
  // e^t, within 5.3e-16
  DoubleLanes e = mulAdd(t, 2.7596488637873553e-6, 2.4844678757813965e-5);
  e = mulAdd(t, e, 0.00019841248416052621);
  e = mulAdd(t, e, 0.001388886531747104);
  e = mulAdd(t, e, 0.0083333333381161926);
  e = mulAdd(t, e, 0.041666666719287221);
  e = mulAdd(t, e, 0.1666666666666293);
  e = mulAdd(t, e, 0.49999999999958888);
  e = mulAdd(t, e, 1);
  e = mulAdd(t, e, 1.0000000000000005);
  for (int doubling = 0; doubling < 10; ++doubling) e = e * e;
  return e;
}

} // namespace
} // namespace surflect::warp
