// The cloud on the screen: culling and footprints.
#pragma once

#include "render/splat/splat_lanes.h"

namespace surflect::splat {
namespace {

// [Zwicker 2001, 2004] as in splat.cpp, in float but for the position, which is large compared with the
// splat. What would cancel is written so that it does not: det V is that of the homography's matrix squared,
// and the smaller eigenvalue of V is det V over the larger.

// Survivors of culling, by field; a group of lanes may write 16 past the last.
constexpr int kChunk = 512;
struct Survivors {
  float pixelX[kChunk + kLanes], pixelY[kChunk + kLanes]; // of the position
  float qx[kChunk + kLanes], qy[kChunk + kLanes];         // on the normalised image
  float inverseDepth[kChunk + kLanes];
  float u0[kChunk + kLanes], u1[kChunk + kLanes], u2[kChunk + kLanes]; // camera space
  float v0[kChunk + kLanes], v1[kChunk + kLanes], v2[kChunk + kLanes];
  float s[kChunk + kLanes], coverage[kChunk + kLanes];
  float area[kChunk + kLanes];   // |u x v|
  float cosine[kChunk + kLanes]; // |(u x v) . p| / (depth area)
  float index[kChunk + kLanes];  // within the chunk
};

struct Triples {
  float x[kLanes], y[kLanes], z[kLanes];
};

template <class Number> inline void take(const Number* from, int count, float* to, float otherwise) {
  if (count == kLanes) {
    for (int i = 0; i < kLanes; ++i) to[i] = static_cast<float>(from[i]);
  } else {
    for (int i = 0; i < kLanes; ++i) to[i] = i < count ? static_cast<float>(from[i]) : otherwise;
  }
}
inline Triples takeTriples(const float* from, int count) {
  Triples t;
  if (count == kLanes) {
    for (int i = 0; i < kLanes; ++i) {
      t.x[i] = from[3 * i];
      t.y[i] = from[3 * i + 1];
      t.z[i] = from[3 * i + 2];
    }
  } else {
    for (int i = 0; i < kLanes; ++i) {
      const bool there = i < count;
      t.x[i] = there ? from[3 * i] : 0;
      t.y[i] = there ? from[3 * i + 1] : 0;
      t.z[i] = there ? from[3 * i + 2] : 0;
    }
  }
  return t;
}

// Culls lanes [0, count) from splat `first` of the chunk at `begin` on.
inline int cull(const ProjectJob& job, size_t begin, int first, int count, Survivors& out, int kept,
                size_t* rejected) {
  const size_t at = begin + static_cast<size_t>(first);
  const Triples p = takeTriples(job.p + 3 * at, count);
  const Triples u = takeTriples(job.u + 3 * at, count);
  const Triples v = takeTriples(job.v + 3 * at, count);
  float handedness[kLanes], radius[kLanes], coverage[kLanes], index[kLanes];
  take(job.handedness + at, count, handedness, 0);
  take(job.radius + at, count, radius, 0);
  take(job.coverage + at, count, coverage, 0);

  float cameraX[kLanes], cameraY[kLanes], depth[kLanes], inverseDepth[kLanes];
  float qx[kLanes], qy[kLanes], pixelX[kLanes], pixelY[kLanes];
  const double* R = job.rotation;
  const double* t = job.translation;
  for (int i = 0; i < kLanes; ++i) {
    const double x = p.x[i], y = p.y[i], z = p.z[i];
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
  }

  const auto rotated = [&](int row, const Triples& d) {
    const double* r = job.rotation + 3 * row;
    return mulAdd(broadcast(static_cast<float>(r[0])), load(d.x),
                  mulAdd(broadcast(static_cast<float>(r[1])), load(d.y),
                         broadcast(static_cast<float>(r[2])) * load(d.z)));
  };
  const Lanes zero = broadcast(0), huge = broadcast(kHuge);
  const Lanes u0 = rotated(0, u), u1 = rotated(1, u), u2 = rotated(2, u);
  const Lanes v0 = rotated(0, v), v1 = rotated(1, v), v2 = rotated(2, v);
  const Lanes n0 = u1 * v2 - u2 * v1, n1 = u2 * v0 - u0 * v2, n2 = u0 * v1 - u1 * v0;
  const Lanes X = load(cameraX), Y = load(cameraY), d = load(depth);
  const Lanes s = load(radius) * broadcast(static_cast<float>(job.sigmaPerRadius)), peak = load(coverage);

  const Lanes areaSquared = mulAdd(n0, n0, mulAdd(n1, n1, n2 * n2));
  const Lanes towards = n2 * d - mulAdd(n0, X, n1 * Y); // (u x v) . -p
  const Mask alive = zero < load(handedness) * load(handedness);
  const Mask finite = (absolute(X + Y + d) <= huge) & (zero < areaSquared) & (areaSquared <= huge) &
                      (zero < s) & (s <= huge) & (zero < peak) & (peak <= huge);
  const Lanes reach = broadcast(kCutoff) * s * sqrt(mulAdd(u2, u2, v2 * v2));
  const Mask far =
      max(broadcast(job.nearDepth), broadcast(static_cast<float>(kNearestDepthFraction)) * d) < d - reach;
  const Mask facing = zero < load(handedness) * towards;

  const Mask there = firstLanes(count);
  const Mask live = there & alive, sound = live & finite, distant = sound & far, drawn = distant & facing;
  rejected[static_cast<int>(Rejection::dead)] += static_cast<size_t>(ones(andNot(there, alive)));
  rejected[static_cast<int>(Rejection::notFinite)] += static_cast<size_t>(ones(andNot(live, finite)));
  rejected[static_cast<int>(Rejection::tooNear)] += static_cast<size_t>(ones(andNot(sound, far)));
  rejected[static_cast<int>(Rejection::backFacing)] += static_cast<size_t>(ones(andNot(distant, facing)));
  if (bitsOf(drawn) == 0) return 0;

  const Lanes area = sqrt(areaSquared);
  storeCompressed(out.pixelX + kept, drawn, load(pixelX));
  storeCompressed(out.pixelY + kept, drawn, load(pixelY));
  storeCompressed(out.qx + kept, drawn, load(qx));
  storeCompressed(out.qy + kept, drawn, load(qy));
  storeCompressed(out.inverseDepth + kept, drawn, load(inverseDepth));
  storeCompressed(out.u0 + kept, drawn, u0);
  storeCompressed(out.u1 + kept, drawn, u1);
  storeCompressed(out.u2 + kept, drawn, u2);
  storeCompressed(out.v0 + kept, drawn, v0);
  storeCompressed(out.v1 + kept, drawn, v1);
  storeCompressed(out.v2 + kept, drawn, v2);
  storeCompressed(out.s + kept, drawn, s);
  storeCompressed(out.coverage + kept, drawn, peak);
  storeCompressed(out.area + kept, drawn, area);
  storeCompressed(out.cosine + kept, drawn, absolute(towards) / (d * area));
  storeCompressed(out.index + kept, drawn, load(index));
  return ones(drawn);
}

// The footprints of survivors [at, at + count); returns how many are drawn.
inline int footprints(const ProjectJob& job, size_t begin, const Survivors& in, int at, int count,
                      ScreenSplat* out, size_t* rejected) {
  const Lanes zero = broadcast(0), one = broadcast(1), huge = broadcast(kHuge);
  const Lanes iz = load(in.inverseDepth + at), qx = load(in.qx + at), qy = load(in.qy + at),
              s = load(in.s + at);
  const Lanes focalX = broadcast(static_cast<float>(job.focalX)),
              focalY = broadcast(static_cast<float>(job.focalY));

  // imageOfPlane
  const Lanes wu = zero - load(in.u2 + at) * iz, wv = zero - load(in.v2 + at) * iz;
  const Lanes au0 = load(in.u0 + at) * iz - qx * wu, av0 = load(in.v0 + at) * iz - qx * wv;
  const Lanes au1 = zero - mulAdd(load(in.u1 + at), iz, qy * wu),
              av1 = zero - mulAdd(load(in.v1 + at), iz, qy * wv);
  const Lanes au2 = wu * iz, av2 = wv * iz;
  // gaussianOfCircle, x and y scaled to pixels
  const Lanes s2 = s * s;
  const Lanes D = one - s2 * mulAdd(wu, wu, wv * wv);
  const Lanes k = s2 / D;
  const Lanes shift0 = zero - k * mulAdd(au0, wu, av0 * wv) * focalX;
  const Lanes shift1 = zero - k * mulAdd(au1, wu, av1 * wv) * focalY;
  const Lanes shift2 = zero - k * mulAdd(au2, wu, av2 * wv);
  const Lanes fu0 = au0 * focalX, fv0 = av0 * focalX, fu1 = au1 * focalY, fv1 = av1 * focalY;
  const Lanes V00 = mulAdd(k, mulAdd(fu0, fu0, fv0 * fv0), shift0 * shift0);
  const Lanes V01 = mulAdd(k, mulAdd(fu0, fu1, fv0 * fv1), shift0 * shift1);
  const Lanes V11 = mulAdd(k, mulAdd(fu1, fu1, fv1 * fv1), shift1 * shift1);
  const Lanes C0 = mulAdd(k, mulAdd(fu0, au2, fv0 * av2), shift0 * shift2);
  const Lanes C1 = mulAdd(k, mulAdd(fu1, au2, fv1 * av2), shift1 * shift2);
  const Lanes minor = fu0 * fv1 - fu1 * fv0;
  const Lanes root = k * minor; // its square is within range where k's would not be
  const Lanes detV = root * root / D;

  // filtered: with r = (h^2 - smaller) / (larger - smaller) in [0, 1], V + D = (1 - r) V + c I, where
  // c = most + r smaller, and D = c I - r V; the eigenvalues of V + D are those of V, but no less than h^2.
  const float h2 = job.lowPass * job.lowPass;
  const Lanes H = broadcast(h2);
  const Lanes trace = V00 + V11, half = (V00 - V11) * broadcast(0.5f);
  const Lanes larger = mulAdd(trace, broadcast(0.5f), sqrt(mulAdd(half, half, V01 * V01)));
  const Lanes smaller = detV / larger;
  const Lanes r = min(max((H - smaller) / (larger - smaller), zero), one); // a circle's, 0/0, is 0
  const Lanes c = mulAdd(r, smaller, max(H - smaller, zero));
  const Lanes F00 = mulAdd(one - r, V00, c), F01 = (one - r) * V01, F11 = mulAdd(one - r, V11, c);
  const Lanes inverseDet = one / (max(smaller, H) * max(larger, H));
  const Lanes slope0 = (F11 * C0 - F01 * C1) * inverseDet, slope1 = (F00 * C1 - F01 * C0) * inverseDet;
  const Lanes peak = load(in.coverage + at) * sqrt(detV * inverseDet);
  const Lanes damp = broadcast(h2 / 4) * larger / (larger + H); // h^2 / 4k
  const Lanes inverseDetG = one / mulAdd(damp, trace + damp, detV);
  const Lanes g0 = ((V11 + damp) * C0 - V01 * C1) * inverseDetG,
              g1 = ((V00 + damp) * C1 - V01 * C0) * inverseDetG;
  const Lanes Dg0 = (c - r * V00) * g0 - r * V01 * g1, Dg1 = (c - r * V11) * g1 - r * V01 * g0;
  const Lanes variance =
      mulAdd(Dg0 * Dg0, F11, mulAdd(Dg1 * Dg1, F00, broadcast(-2) * (Dg0 * Dg1 * F01))) * inverseDet;
  const Lanes deviation = sqrt(max(variance, zero));
  // bendTolerance
  const Lanes depthTolerance =
      s * sqrt(load(in.area + at)) * min(broadcast(static_cast<float>(kBend)) / load(in.cosine + at), one);
  const Lanes tolerance =
      mulAdd(broadcast(static_cast<float>(kDepthSigmas)), deviation, depthTolerance * iz * iz);

  const Lanes x = load(in.pixelX + at) + shift0, y = load(in.pixelY + at) + shift1;
  const Lanes xx = F11 * inverseDet, yy = one / F11, skew = zero - F01 * yy;
  const Lanes order = shift2 - iz;
  const Lanes perCutoff = broadcast(1 / kCutoff);
  const Lanes ax = sqrt(xx) * perCutoff, ay = ax * skew, by = sqrt(yy) * perCutoff;

  // clippedBox
  const auto firstPixel = [&](Lanes low, int size) {
    return min(max(ceil(low - broadcast(0.5f)), zero), broadcast(static_cast<float>(size)));
  };
  const Lanes halfX = broadcast(kCutoff) * sqrt(F00), halfY = broadcast(kCutoff) * sqrt(F11);
  const Lanes x0 = firstPixel(x - halfX, job.width), x1 = firstPixel(x + halfX, job.width);
  const Lanes y0 = firstPixel(y - halfY, job.height), y1 = firstPixel(y + halfY, job.height);

  const Lanes sum = x + y + xx + skew + yy + peak + order + slope0 + slope1 + tolerance;
  const Mask there = firstLanes(count);
  const Mask finite = (absolute(sum) <= huge) & (zero < xx) & (zero < yy);
  const Mask inside = (x0 < x1) & (y0 < y1);
  const uint32_t drawn = bitsOf(there & finite & inside);
  rejected[static_cast<int>(Rejection::notFinite)] += static_cast<size_t>(ones(andNot(there, finite)));
  rejected[static_cast<int>(Rejection::outside)] += static_cast<size_t>(ones(andNot(there & finite, inside)));

  constexpr int kFields = 15;
  float fields[kFields][kLanes];
  const Lanes values[kFields] = {x,      y,      order,     ax, ay, by, peak, peak * broadcast(kAreaPeak),
                                 slope0, slope1, tolerance, x0, y0, x1, y1};
  for (int f = 0; f < kFields; ++f) store(fields[f], values[f]);
  int n = 0;
  for (uint32_t bits = drawn; bits != 0; bits &= bits - 1) {
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

inline size_t projectLoop(const ProjectJob& job, size_t begin, size_t end, ScreenSplat* out,
                          size_t* rejected) {
  Survivors survivors;
  size_t drawn = 0;
  for (size_t chunk = begin; chunk < end; chunk += kChunk) {
    const int size = end - chunk < kChunk ? static_cast<int>(end - chunk) : kChunk;
    int kept = 0;
    for (int i = 0; i < size; i += kLanes)
      kept += cull(job, chunk, i, size - i < kLanes ? size - i : kLanes, survivors, kept, rejected);
    for (int i = 0; i < kept; i += kLanes)
      drawn += static_cast<size_t>(
          footprints(job, chunk, survivors, i, kept - i < kLanes ? kept - i : kLanes, out + drawn, rejected));
  }
  return drawn;
}

} // namespace
} // namespace surflect::splat
