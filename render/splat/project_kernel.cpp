#include "render/splat/splat_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/splat/project_kernel.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include "render/splat/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace surflect::splat {
namespace HWY_NAMESPACE {
namespace {

using Floats = hn::Vec<PixelTag>; // one splat per lane
using FloatMask = hn::Mask<PixelTag>;
HWY_INLINE Floats number(float x) { return hn::Set(kFloats, x); }
HWY_INLINE Floats number(double x) { return number(static_cast<float>(x)); }
HWY_INLINE Floats number(int x) { return number(static_cast<float>(x)); }
HWY_INLINE Floats floatsAt(const float* from) { return hn::LoadU(kFloats, from); }

// Projection of splats as in splat.cpp [Zwicker 2001, 2004], in single precision except for positions, which
// are large compared with the splat. Cancellation is avoided: det V is the square of the determinant of the
// homography's matrix, and the smaller eigenvalue of V is det V over the larger.

// Splats that survive culling, field by field; a group of lanes may write 16 entries past the last.
constexpr int kChunk = 512;
struct Survivors {
  float pixelX[kChunk + kVectorLanes], pixelY[kChunk + kVectorLanes]; // projected position
  float qx[kChunk + kVectorLanes], qy[kChunk + kVectorLanes];         // on the normalised image plane
  float inverseDepth[kChunk + kVectorLanes];
  float u0[kChunk + kVectorLanes], u1[kChunk + kVectorLanes], u2[kChunk + kVectorLanes]; // camera space
  float v0[kChunk + kVectorLanes], v1[kChunk + kVectorLanes], v2[kChunk + kVectorLanes];
  float s[kChunk + kVectorLanes], coverage[kChunk + kVectorLanes];
  float area[kChunk + kVectorLanes];   // |u x v|
  float cosine[kChunk + kVectorLanes]; // |(u x v) . p| / (depth area)
  float index[kChunk + kVectorLanes];  // within the chunk
};

struct Triples {
  Floats x, y, z;
};

// The first `count` numbers in lanes, padded with 0.
template <class Number, int kEach = 1> struct Padded {
  Number padded[kEach * kVectorLanes];
  const Number* from;
  HWY_INLINE Padded(const Number* numbers, int count) : from(numbers) {
    if (count == kVectorLanes) return;
    for (int i = 0; i < kEach * kVectorLanes; ++i) padded[i] = i < kEach * count ? numbers[i] : Number{};
    from = padded;
  }
};
HWY_INLINE Triples takeTriples(const float* from, int count) {
  const Padded<float, 3> triples(from, count);
  Triples t;
  hn::LoadInterleaved3(kFloats, triples.from, t.x, t.y, t.z);
  return t;
}

// Stores the lanes of the mask contiguously; writes all lanes.
HWY_INLINE void storeCompressed(float* to, FloatMask m, Floats x) {
  hn::StoreU(hn::Compress(x, m), kFloats, to); // masked stores are slow
}

HWY_INLINE FloatMask both(FloatMask a, FloatMask b) { return hn::And(a, b); }
template <class... More> HWY_INLINE FloatMask both(FloatMask a, FloatMask b, More... more) {
  return both(both(a, b), more...);
}
// Counts the lanes in a that are not in b as rejected for a reason.
HWY_INLINE void countRejected(size_t* rejected, Rejection why, FloatMask a, FloatMask b) {
  rejected[static_cast<int>(why)] += hn::CountTrue(kFloats, hn::AndNot(b, a));
}

// Culls lanes [0, count), from splat `first` of the chunk at `begin` on.
HWY_INLINE int cull(const ProjectJob& job, size_t begin, int first, int count, Survivors& out, int kept,
                    size_t* rejected) {
  const size_t at = begin + static_cast<size_t>(first);
  const Padded<float, 3> p(job.p + 3 * at, count);
  const Triples u = takeTriples(job.u + 3 * at, count), v = takeTriples(job.v + 3 * at, count);
  const Padded<int8_t> signs(job.handedness + at, count);
  const Padded<float> radius(job.radius + at, count), coverage(job.coverage + at, count);
  float signOf[kVectorLanes], index[kVectorLanes];

  float cameraX[kVectorLanes], cameraY[kVectorLanes], depth[kVectorLanes], inverseDepth[kVectorLanes];
  float qx[kVectorLanes], qy[kVectorLanes], pixelX[kVectorLanes], pixelY[kVectorLanes];
  const double* R = job.rotation;
  const double* t = job.translation;
  for (int i = 0; i < kVectorLanes; ++i) {
    const double x = p.from[3 * i], y = p.from[3 * i + 1], z = p.from[3 * i + 2];
    const double cx = R[0] * x + R[1] * y + R[2] * z + t[0];
    const double cy = R[3] * x + R[4] * y + R[5] * z + t[1];
    const double d = -(R[6] * x + R[7] * y + R[8] * z + t[2]);
    const double inverse = 1 / d;
    cameraX[i] = static_cast<float>(cx);
    cameraY[i] = static_cast<float>(cy);
    depth[i] = static_cast<float>(d);
    inverseDepth[i] = static_cast<float>(inverse);
    qx[i] = static_cast<float>(cx * inverse);
    qy[i] = static_cast<float>(-cy * inverse);
    pixelX[i] = static_cast<float>(job.centerX + job.focalX * (cx * inverse));
    pixelY[i] = static_cast<float>(job.centerY - job.focalY * (cy * inverse));
    index[i] = static_cast<float>(first + i);
    signOf[i] = signs.from[i];
  }

  const auto rotated = [&](int row, const Triples& d) HWY_ATTR {
    const double* r = job.rotation + 3 * row;
    return MulAdd(number(r[0]), d.x, MulAdd(number(r[1]), d.y, number(r[2]) * d.z));
  };
  const Floats zero = number(0), huge = number(kHuge);
  const Floats u0 = rotated(0, u), u1 = rotated(1, u), u2 = rotated(2, u);
  const Floats v0 = rotated(0, v), v1 = rotated(1, v), v2 = rotated(2, v);
  const Floats n0 = u1 * v2 - u2 * v1, n1 = u2 * v0 - u0 * v2, n2 = u0 * v1 - u1 * v0;
  const Floats X = floatsAt(cameraX), Y = floatsAt(cameraY), d = floatsAt(depth);
  const Floats s = floatsAt(radius.from) * number(job.sigmaPerRadius), peak = floatsAt(coverage.from);

  const Floats areaSquared = MulAdd(n0, n0, MulAdd(n1, n1, n2 * n2));
  const Floats towards = n2 * d - MulAdd(n0, X, n1 * Y); // (u x v) . -p
  const Floats handedness = floatsAt(signOf);
  const FloatMask alive = zero < handedness * handedness;
  const FloatMask finite = both(Abs(X + Y + d) <= huge, zero < areaSquared, areaSquared <= huge, zero < s,
                                s <= huge, zero < peak, peak <= huge);
  const Floats reach = number(kCutoff) * s * Sqrt(MulAdd(u2, u2, v2 * v2));
  const FloatMask far = Max(number(job.nearDepth), number(kNearestDepthFraction) * d) < d - reach;
  const FloatMask facing = zero < handedness * towards;

  const FloatMask there = hn::FirstN(kFloats, static_cast<size_t>(count));
  const FloatMask live = both(there, alive), sound = both(live, finite), distant = both(sound, far),
                  drawn = both(distant, facing);
  countRejected(rejected, Rejection::dead, there, alive);
  countRejected(rejected, Rejection::notFinite, live, finite);
  countRejected(rejected, Rejection::tooNear, sound, far);
  countRejected(rejected, Rejection::backFacing, distant, facing);
  if (hn::AllFalse(kFloats, drawn)) return 0;

  const Floats area = Sqrt(areaSquared);
  storeCompressed(out.pixelX + kept, drawn, floatsAt(pixelX));
  storeCompressed(out.pixelY + kept, drawn, floatsAt(pixelY));
  storeCompressed(out.qx + kept, drawn, floatsAt(qx));
  storeCompressed(out.qy + kept, drawn, floatsAt(qy));
  storeCompressed(out.inverseDepth + kept, drawn, floatsAt(inverseDepth));
  storeCompressed(out.u0 + kept, drawn, u0);
  storeCompressed(out.u1 + kept, drawn, u1);
  storeCompressed(out.u2 + kept, drawn, u2);
  storeCompressed(out.v0 + kept, drawn, v0);
  storeCompressed(out.v1 + kept, drawn, v1);
  storeCompressed(out.v2 + kept, drawn, v2);
  storeCompressed(out.s + kept, drawn, s);
  storeCompressed(out.coverage + kept, drawn, peak);
  storeCompressed(out.area + kept, drawn, area);
  storeCompressed(out.cosine + kept, drawn, Abs(towards) / (d * area));
  storeCompressed(out.index + kept, drawn, floatsAt(index));
  return static_cast<int>(hn::CountTrue(kFloats, drawn));
}

// Computes the footprints of survivors [at, at + count); returns the number drawn.
HWY_INLINE int footprints(const ProjectJob& job, size_t begin, const Survivors& in, int at, int count,
                          ScreenSplat* out, size_t* rejected) {
  const Floats zero = number(0), one = number(1), huge = number(kHuge);
  const Floats iz = floatsAt(in.inverseDepth + at), qx = floatsAt(in.qx + at), qy = floatsAt(in.qy + at),
               s = floatsAt(in.s + at);
  const Floats focalX = number(job.focalX), focalY = number(job.focalY);

  // imageOfPlane
  const Floats wu = zero - floatsAt(in.u2 + at) * iz, wv = zero - floatsAt(in.v2 + at) * iz;
  const Floats au0 = floatsAt(in.u0 + at) * iz - qx * wu, av0 = floatsAt(in.v0 + at) * iz - qx * wv;
  const Floats au1 = zero - MulAdd(floatsAt(in.u1 + at), iz, qy * wu),
               av1 = zero - MulAdd(floatsAt(in.v1 + at), iz, qy * wv);
  const Floats au2 = wu * iz, av2 = wv * iz;
  // gaussianOfCircle, x and y scaled to pixels
  const Floats s2 = s * s;
  const Floats D = one - s2 * MulAdd(wu, wu, wv * wv);
  const Floats k = s2 / D;
  const Floats shift0 = zero - k * MulAdd(au0, wu, av0 * wv) * focalX;
  const Floats shift1 = zero - k * MulAdd(au1, wu, av1 * wv) * focalY;
  const Floats shift2 = zero - k * MulAdd(au2, wu, av2 * wv);
  const Floats fu0 = au0 * focalX, fv0 = av0 * focalX, fu1 = au1 * focalY, fv1 = av1 * focalY;
  const Floats V00 = MulAdd(k, MulAdd(fu0, fu0, fv0 * fv0), shift0 * shift0);
  const Floats V01 = MulAdd(k, MulAdd(fu0, fu1, fv0 * fv1), shift0 * shift1);
  const Floats V11 = MulAdd(k, MulAdd(fu1, fu1, fv1 * fv1), shift1 * shift1);
  const Floats C0 = MulAdd(k, MulAdd(fu0, au2, fv0 * av2), shift0 * shift2);
  const Floats C1 = MulAdd(k, MulAdd(fu1, au2, fv1 * av2), shift1 * shift2);
  const Floats minor = fu0 * fv1 - fu1 * fv0;
  const Floats root = k * minor; // its square stays in range where k's would not
  const Floats detV = root * root / D;

  // lowPassed (low_pass.h): with r = (h^2 - smaller) / (larger - smaller) in [0, 1], V + D = (1 - r) V + c I,
  // where c = most + r smaller, and D = c I - r V; the eigenvalues of V + D are those of V, but no less than
  // h^2.
  const float h2 = job.lowPass * job.lowPass;
  const Floats H = number(h2);
  const Floats trace = V00 + V11, half = (V00 - V11) * number(0.5f);
  const Floats larger = MulAdd(trace, number(0.5f), Sqrt(MulAdd(half, half, V01 * V01)));
  const Floats smaller = detV / larger;
  const Floats r = Min(Max((H - smaller) / (larger - smaller), zero), one); // 0/0 for a circle becomes 0
  const Floats c = MulAdd(r, smaller, Max(H - smaller, zero));
  const Floats F00 = MulAdd(one - r, V00, c), F01 = (one - r) * V01, F11 = MulAdd(one - r, V11, c);
  const Floats inverseDet = one / (Max(smaller, H) * Max(larger, H));
  const Floats slope0 = (F11 * C0 - F01 * C1) * inverseDet, slope1 = (F00 * C1 - F01 * C0) * inverseDet;
  const Floats peak = floatsAt(in.coverage + at) * Sqrt(detV * inverseDet);
  const Floats damp = number(h2 / 4) * larger / (larger + H); // h^2 / 4k
  const Floats inverseDetG = one / MulAdd(damp, trace + damp, detV);
  const Floats g0 = ((V11 + damp) * C0 - V01 * C1) * inverseDetG,
               g1 = ((V00 + damp) * C1 - V01 * C0) * inverseDetG;
  const Floats Dg0 = (c - r * V00) * g0 - r * V01 * g1, Dg1 = (c - r * V11) * g1 - r * V01 * g0;
  const Floats variance =
      MulAdd(Dg0 * Dg0, F11, MulAdd(Dg1 * Dg1, F00, number(-2) * (Dg0 * Dg1 * F01))) * inverseDet;
  const Floats deviation = Sqrt(Max(variance, zero));
  // bendTolerance
  const Floats depthTolerance =
      s * Sqrt(floatsAt(in.area + at)) * Min(number(kMaxSurfaceDeviation) / floatsAt(in.cosine + at), one);
  const Floats tolerance = MulAdd(number(kDepthSigmas), deviation, depthTolerance * iz * iz);

  const Floats x = floatsAt(in.pixelX + at) + shift0, y = floatsAt(in.pixelY + at) + shift1;
  const Floats xx = F11 * inverseDet, yy = one / F11, skew = zero - F01 * yy;
  const Floats order = shift2 - iz;
  const Floats perCutoff = number(1 / kCutoff);
  const Floats ax = Sqrt(xx) * perCutoff, ay = ax * skew, by = Sqrt(yy) * perCutoff;

  // clippedBox
  const auto firstPixel = [&](Floats low, int size)
                              HWY_ATTR { return Min(Max(Ceil(low - number(0.5f)), zero), number(size)); };
  const Floats halfX = number(kCutoff) * Sqrt(F00), halfY = number(kCutoff) * Sqrt(F11);
  const Floats x0 = firstPixel(x - halfX, job.width), x1 = firstPixel(x + halfX, job.width);
  const Floats y0 = firstPixel(y - halfY, job.height), y1 = firstPixel(y + halfY, job.height);

  const Floats sum = x + y + xx + skew + yy + peak + order + slope0 + slope1 + tolerance;
  const FloatMask there = hn::FirstN(kFloats, static_cast<size_t>(count));
  const FloatMask finite = both(Abs(sum) <= huge, zero < xx, zero < yy);
  const FloatMask inside = both(x0 < x1, y0 < y1), sound = both(there, finite);
  countRejected(rejected, Rejection::notFinite, there, finite);
  countRejected(rejected, Rejection::outside, sound, inside);

  constexpr int kFields = 15;
  float fields[kFields][kVectorLanes];
  const Floats values[kFields] = {x,      y,      order,     ax, ay, by, peak, peak * number(kAreaPeak),
                                  slope0, slope1, tolerance, x0, y0, x1, y1};
  for (int f = 0; f < kFields; ++f) hn::StoreU(values[f], kFloats, fields[f]);
  int n = 0;
  for (uint32_t bits = bitsOf(both(sound, inside)); bits != 0; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    ScreenSplat& to = out[n];
    to.x = fields[0][i], to.y = fields[1][i], to.order = fields[2][i];
    SplatShape& shape = to.shape;
    shape.ax = fields[3][i], shape.ay = fields[4][i], shape.by = fields[5][i];
    shape.peak = fields[6][i], shape.areaPeak = fields[7][i];
    shape.orderX = fields[8][i], shape.orderY = fields[9][i], shape.tolerance = fields[10][i];
    to.box.x0 = static_cast<int>(fields[11][i]), to.box.y0 = static_cast<int>(fields[12][i]);
    to.box.x1 = static_cast<int>(fields[13][i]), to.box.y1 = static_cast<int>(fields[14][i]);
    to.splat = static_cast<uint32_t>(begin) + static_cast<uint32_t>(in.index[at + i]);
    ++n;
  }
  return n;
}

size_t projectSplats(const ProjectJob& job, size_t begin, size_t end, ScreenSplat* out, size_t* rejected) {
  Survivors survivors;
  size_t drawn = 0;
  for (size_t chunk = begin; chunk < end; chunk += kChunk) {
    const int size = end - chunk < kChunk ? static_cast<int>(end - chunk) : kChunk;
    int kept = 0;
    for (int i = 0; i < size; i += kVectorLanes)
      kept +=
          cull(job, chunk, i, size - i < kVectorLanes ? size - i : kVectorLanes, survivors, kept, rejected);
    for (int i = 0; i < kept; i += kVectorLanes)
      drawn += static_cast<size_t>(footprints(job, chunk, survivors, i,
                                              kept - i < kVectorLanes ? kept - i : kVectorLanes, out + drawn,
                                              rejected));
  }
  return drawn;
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::splat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::splat {

HWY_EXPORT(projectSplats);
size_t projectSplats(const ProjectJob& job, size_t begin, size_t end, ScreenSplat* out, size_t* rejected) {
  return HWY_DYNAMIC_DISPATCH(projectSplats)(job, begin, end, out, rejected);
}
} // namespace surflect::splat
#endif
