// The loops of splat_kernels.h, in the lanes that the compiler was told to use.
#pragma once

#include "render/splat_kernels.h"
#include "surfel/lanes.h"

namespace surflect {
namespace {

// [Zwicker 2001, 2004] as in splat.cpp, in float but for the position, which is large compared with the
// splat. What would cancel is written so that it does not: det V is that of the homography's matrix squared,
// and the smaller eigenvalue of V is det V over the larger.

constexpr float kHuge = 3.0e38f;
constexpr float kInfinity = __builtin_inff();
constexpr float kCutoff = static_cast<float>(kCutoffSigmas);

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

inline int ones(Mask m) { return __builtin_popcount(bitsOf(m)); }
inline Lanes absolute(Lanes a) { return max(a, broadcast(0) - a); }

inline uint32_t roundedUp(uint32_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

// The first `count` lanes.
inline Mask firstLanes(int count) {
  float lane[kLanes];
  for (int i = 0; i < kLanes; ++i) lane[i] = static_cast<float>(i);
  return load(lane) < broadcast(static_cast<float>(count));
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

  float fields[14][kLanes];
  const Lanes values[14] = {x, y, xx, skew, yy, peak, order, slope0, slope1, tolerance, x0, y0, x1, y1};
  for (int f = 0; f < 14; ++f) store(fields[f], values[f]);
  int n = 0;
  for (uint32_t bits = drawn; bits != 0; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    Footprint& f = out[n].footprint;
    f.x = fields[0][i], f.y = fields[1][i];
    f.xx = fields[2][i], f.skew = fields[3][i], f.yy = fields[4][i];
    f.peak = fields[5][i];
    f.order = fields[6][i], f.orderX = fields[7][i], f.orderY = fields[8][i];
    f.tolerance = fields[9][i];
    f.box.x0 = static_cast<int>(fields[10][i]), f.box.y0 = static_cast<int>(fields[11][i]);
    f.box.x1 = static_cast<int>(fields[12][i]), f.box.y1 = static_cast<int>(fields[13][i]);
    out[n].splat = static_cast<uint32_t>(begin) + static_cast<uint32_t>(in.index[at + i]);
    ++n;
  }
  return n;
}

size_t projectLoop(const ProjectJob& job, size_t begin, size_t end, ScreenSplat* out, size_t* rejected) {
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

void listBlocksLoop(TileLists& tile) {
  // Counts at the corners of boxes; sums over all before them, in x and y, are the counts of blocks.
  constexpr int stride = kBlocksPerRow + 1;
  int32_t counts[stride * stride] = {};
  for (uint32_t i = 0; i < tile.count; ++i) {
    const TileSplat& s = tile.splats[i];
    ++counts[s.blockY0 * stride + s.blockX0];
    --counts[s.blockY0 * stride + s.blockX1];
    --counts[s.blockY1 * stride + s.blockX0];
    ++counts[s.blockY1 * stride + s.blockX1];
  }
  uint32_t begin = 0, ends[kBlocks];
  for (int y = 0; y < kBlocksPerRow; ++y) {
    int32_t rowSum = 0; // down to this row, left of and at the block
    for (int x = 0; x < kBlocksPerRow; ++x) {
      if (y > 0) counts[y * stride + x] += counts[(y - 1) * stride + x];
      rowSum += counts[y * stride + x];
      tile.begin[y * kBlocksPerRow + x] = ends[y * kBlocksPerRow + x] = begin;
      begin += static_cast<uint32_t>(rowSum);
    }
  }
  uint32_t* list = tile.list;
  const uint32_t count = tile.count;
  for (uint32_t i = 0; i < count; ++i) {
    const TileSplat& s = tile.splats[i];
    const int x0 = s.blockX0, x1 = s.blockX1, y1 = s.blockY1;
    for (int y = s.blockY0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) list[ends[y * kBlocksPerRow + x]++] = i;
  }
  __builtin_memcpy(tile.end, ends, sizeof ends);
}

// Pixel centres of a block, from the middle of its tile.
struct Centers {
  Lanes x, y;
};
inline Centers centersOf(int block) {
  float x[kLanes], y[kLanes];
  const int x0 = block % kBlocksPerRow * kBlockSize, y0 = block / kBlocksPerRow * kBlockSize;
  for (int i = 0; i < kLanes; ++i) {
    x[i] = static_cast<float>(x0 + i % kBlockSize - kTileSize / 2) + 0.5f;
    y[i] = static_cast<float>(y0 + i / kBlockSize - kTileSize / 2) + 0.5f;
  }
  return {load(x), load(y)};
}

inline Lanes qOf(const TileSplat& s, const Centers& at) {
  const Lanes a = mulAdd(broadcast(s.ax), at.x, mulAdd(broadcast(s.ay), at.y, broadcast(s.a0)));
  const Lanes b = mulAdd(broadcast(s.by), at.y, broadcast(s.b0));
  return mulAdd(a, a, b * b);
}
inline Lanes orderOf(const TileSplat& s, const Centers& at) {
  return mulAdd(broadcast(s.orderX), at.x, mulAdd(broadcast(s.orderY), at.y, broadcast(s.order0)));
}

// exp(-q/2) for q from 0 to kCutoff^2, within 4e-6 of itself: the interpolant of exp(-q/16) at six Chebyshev
// points, to the eighth power.
inline Lanes gaussian(Lanes q) {
  Lanes p = mulAdd(broadcast(-5.448007998045642e-09f), q, broadcast(6.035977234791193e-07f));
  p = mulAdd(p, q, broadcast(-4.049212995508628e-05f));
  p = mulAdd(p, q, broadcast(0.0019525660873959546f));
  p = mulAdd(p, q, broadcast(-0.06249941790408526f));
  p = mulAdd(p, q, broadcast(0.9999999011192711f));
  p = p * p;
  p = p * p;
  return p * p;
}

// How often a block's pixels are asked where their first layer is rooted.
constexpr int kRounds = 4;

inline Lanes saturatedLanes(Lanes area) {
  return min(max((area - broadcast(1 - kFull)) / broadcast(2 * kFull - 1), broadcast(0)), broadcast(1));
}

// The first layer of each pixel of a block, without sorting; layersOf in coverage.cpp says what a layer is.
//
// Where the depth intervals of all fragments have a point in common there is one layer. Elsewhere, `back` is
// a bound from below of how far the layer's intervals reach, first the nearest end of any. It grows by trying
// planes: if the fragments before one have an area of less than kRooted, and none of them breaks away, they
// all extend the layer, and so does the next. The planes halve what is open, by its mean. If everything
// touches `back`, there is one layer. Otherwise `end` is where it would end if it reached to `back` alone; if
// it ends there too when all before `end`, or before a plane with an area of kRooted, extend it, then it does
// end there. If it also fills the pixel, nothing behind matters. The caller looks at what remains, in
// pictures rich in outlines a pixel in forty.
void resolveBlockLoop(const TileLists& tile, int block, int width, int height,
                      const BlockFragments& fragments, BlockLayers& out) {
  float *orders = fragments.orders, *areas = fragments.areas, *tolerances = fragments.tolerances;
  const Centers at = centersOf(block);
  const uint32_t begin = tile.begin[block], count = tile.end[block] - begin;
  const uint32_t* list = tile.list + begin;
  const Lanes infinite = broadcast(kInfinity), zero = broadcast(0);
  const Lanes cutoff = broadcast(kCutoff * kCutoff);

  Lanes total = zero, nearestEnd = infinite, farthestFront = zero - infinite;
  for (uint32_t i = 0; i < count; ++i) {
    const TileSplat& s = tile.splats[list[i]];
    const Lanes q = qOf(s, at), order = orderOf(s, at);
    const Mask in = q <= cutoff;
    const Lanes t = max(mulAdd(q, broadcast(-1 / (kCutoff * kCutoff)), broadcast(1)), zero);
    const Lanes area = t * t * broadcast(s.areaPeak);
    total = total + area;
    nearestEnd = minWhere(in, nearestEnd, order + broadcast(s.tolerance));
    farthestFront = maxWhere(in, farthestFront, order - broadcast(s.tolerance));
    const Lanes there = select(in, order, infinite);
    store(orders + kLanes * i, there);
    store(areas + kLanes * i, area);
    fragments.reached[i] = bitsOf(there < infinite);
    tolerances[i] = s.tolerance;
  }

  const Mask inTile = (at.x < broadcast(static_cast<float>(width - kTileSize / 2))) &
                      (at.y < broadcast(static_cast<float>(height - kTileSize / 2)));
  const Mask covered = inTile & (zero < saturatedLanes(total));
  Lanes layerArea = total, limit = infinite;
  Mask open = andNot(covered, farthestFront <= nearestEnd);
  out.unresolved = 0;
  if (bitsOf(open) != 0) {
    Lanes back = nearestEnd;
    Lanes coreArea = zero, coreMoment = zero;
    for (uint32_t i = 0; i < count; ++i) {
      const Lanes order = load(orders + kLanes * i), area = load(areas + kLanes * i);
      const Mask core = order - broadcast(tolerances[i]) <= back;
      coreArea = addWhere(core, coreArea, area);
      coreMoment = addWhere(core, coreMoment, area * order);
    }
    Lanes plane = coreMoment / coreArea;
    Lanes areaLow = zero, momentLow = zero, areaHigh = coreArea, momentHigh = coreMoment, atMost = infinite;
    Mask trying = open;
    for (int round = 0; round < kRounds && bitsOf(trying) != 0; ++round) {
      Lanes before = zero, moment = zero, reach = back, firstBreak = infinite;
      Lanes next = infinite, nextEnd = infinite; // the nearest beyond the plane, and what it reaches at least
      for (uint32_t i = 0; i < count; ++i) {
        const Lanes order = load(orders + kLanes * i), area = load(areas + kLanes * i);
        const Lanes tolerance = broadcast(tolerances[i]);
        const Mask nearer = order <= plane;
        before = addWhere(nearer, before, area);
        moment = addWhere(nearer, moment, area * order);
        reach = maxWhere(nearer, reach, order + tolerance);
        firstBreak = minWhere(back < order - tolerance, firstBreak, order);
        next = select(nearer, next, min(next, order));
        nextEnd = select(nearer, nextEnd, min(nextEnd, order + tolerance));
      }
      const Mask unrooted = trying & (before < broadcast(kRooted));
      const Mask whole = unrooted & (plane < firstBreak);
      const Mask rooted = andNot(trying, unrooted);
      const Lanes reachOfNext = select((next < firstBreak) & (next < infinite), max(reach, nextEnd), reach);
      back = select(whole, max(back, reachOfNext), back);
      areaLow = select(whole, before, areaLow);
      momentLow = select(whole, moment, momentLow);
      atMost = select(rooted, min(atMost, reach), atMost);
      areaHigh = select(whole, areaHigh, before);
      momentHigh = select(whole, momentHigh, moment);
      trying = andNot(trying, farthestFront <= back);
      plane =
          (momentHigh - momentLow) / (areaHigh - areaLow); // splits what lies between the planes found so far
    }

    open = andNot(open, farthestFront <= back); // the others are one layer
    if (bitsOf(open) != 0) {
      Lanes end = infinite;
      for (uint32_t i = 0; i < count; ++i) {
        const Lanes order = load(orders + kLanes * i);
        end = minWhere(back < order - broadcast(tolerances[i]), end, order);
      }
      Lanes area = zero, reach = back; // of all before the end
      for (uint32_t i = 0; i < count; ++i) {
        const Lanes order = load(orders + kLanes * i);
        const Mask before = order < end;
        area = addWhere(before, area, load(areas + kLanes * i));
        reach = maxWhere(before, reach, order + broadcast(tolerances[i]));
      }
      reach = min(reach, atMost);
      Lanes endAtMost = infinite;
      for (uint32_t i = 0; i < count; ++i) {
        const Lanes order = load(orders + kLanes * i);
        endAtMost = minWhere(reach < order - broadcast(tolerances[i]), endAtMost, order);
      }
      const Mask certain = (endAtMost <= end) & (broadcast(kFull) <= area);
      limit = select(open, end, limit);
      layerArea = select(open, area, layerArea);
      out.unresolved = bitsOf(andNot(open, certain));
    }
  }
  store(out.alpha, select(covered, saturatedLanes(layerArea), zero));
  store(out.area, layerArea);
  store(out.limit, select(covered, limit, zero - infinite));
}

uint32_t gatherPixelLoop(uint32_t count, int lane, const BlockFragments& from, const PixelFragments& to) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < count; i += kLanes) {
    const Lanes orders = loadColumn(from.orders + kLanes * i + lane);
    const Mask in = firstLanes(static_cast<int>(count - i)) & (orders < broadcast(kInfinity));
    storeCompressed(to.order + n, in, orders);
    storeCompressed(to.area + n, in, loadColumn(from.areas + kLanes * i + lane));
    storeCompressed(to.tolerance + n, in, load(from.tolerances + i));
    n += static_cast<uint32_t>(ones(in));
  }
  for (uint32_t i = n; i < roundedUp(n); ++i) {
    to.order[i] = kInfinity;
    to.area[i] = to.tolerance[i] = 0;
  }
  return n;
}

void rankPixelLoop(uint32_t n, const PixelFragments& pixel) {
  const Lanes one = broadcast(1);
  for (uint32_t i = 0; i < n; i += kLanes) {
    const Lanes here = load(pixel.order + i);
    Lanes rank = broadcast(0);
    for (uint32_t j = 0; j < n; ++j) rank = addWhere(broadcast(pixel.order[j]) < here, rank, one);
    store(pixel.work + i, rank);
  }
}

// layersOf in coverage.cpp for the first layer, each fragment compared with each.
bool firstLayerLoop(uint32_t n, const PixelFragments& pixel, int lane, BlockLayers& out) {
  const Lanes infinite = broadcast(kInfinity), zero = broadcast(0);
  const float *order = pixel.order, *tolerance = pixel.tolerance, *area = pixel.area;
  float* ends = pixel.work;
  const uint32_t padded = roundedUp(n);
  for (uint32_t i = 0; i < padded; i += kLanes) {
    const Lanes here = load(order + i);
    Lanes before = zero;
    for (uint32_t j = 0; j < n; ++j)
      before = addWhere(broadcast(order[j]) < here, before, broadcast(area[j]));
    store(ends + i, select(before < broadcast(kRooted), here + load(tolerance + i), zero - infinite));
  }
  Lanes nearest = infinite;
  for (uint32_t i = 0; i < padded; i += kLanes) {
    const Lanes here = load(order + i);
    Lanes back = zero - infinite;
    for (uint32_t j = 0; j < n; ++j) back = maxWhere(broadcast(order[j]) < here, back, broadcast(ends[j]));
    const Mask breaks = (zero - infinite < back) & (back < here - load(tolerance + i));
    nearest = minWhere(breaks, nearest, here);
  }
  float limits[kLanes], sums[kLanes];
  store(limits, nearest);
  float limit = kInfinity;
  for (const float each : limits) limit = each < limit ? each : limit;
  Lanes sum = zero;
  for (uint32_t i = 0; i < padded; i += kLanes)
    sum = addWhere(load(order + i) < broadcast(limit), sum, load(area + i));
  store(sums, sum);
  float total = 0;
  for (const float each : sums) total += each;
  if (!(total >= kFull || limit == kInfinity)) return false;
  float alpha[kLanes];
  store(alpha, saturatedLanes(broadcast(total)));
  out.alpha[lane] = alpha[0];
  out.area[lane] = total;
  out.limit[lane] = limit;
  return true;
}

void keepSeenLoop(TileLists& tile, int block, const BlockFragments& fragments, const float* limits,
                  uint8_t* seen) {
  const Lanes limit = load(limits), infinite = broadcast(kInfinity), zero = broadcast(0);
  const uint32_t whole = bitsOf(infinite <= limit);                              // pixels that show all
  const bool some = bitsOf((zero - infinite < limit) & (limit < infinite)) != 0; // or what is nearer
  const uint32_t begin = tile.begin[block], count = tile.end[block] - begin;
  uint32_t* list = tile.list + begin; // what is read through pointers would be read anew after each byte
  const uint32_t* reached = fragments.reached;
  const float* orders = fragments.orders;
  uint32_t kept = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t splat = list[i];
    bool reaches = (reached[i] & whole) != 0;
    if (some) reaches |= bitsOf(load(orders + kLanes * i) < limit) != 0;
    seen[splat] = static_cast<uint8_t>(seen[splat] | (reaches ? 1 : 0));
    list[kept] = splat;
    kept += reaches ? 1 : 0;
  }
  tile.end[block] = begin + kept;
}

// Calls add(splat of the tile, where it is seen, weights, orders) for each splat of a block's list.
template <class Add> inline void eachWeight(const TileLists& tile, int block, const float* limits, Add add) {
  const Centers at = centersOf(block);
  const Lanes limit = load(limits), cutoff = broadcast(kCutoff * kCutoff), zero = broadcast(0);
  for (uint32_t i = tile.begin[block]; i < tile.end[block]; ++i) {
    const TileSplat& s = tile.splats[tile.list[i]];
    const Lanes q = qOf(s, at), order = orderOf(s, at);
    const Mask in = (q <= cutoff) & (order < limit);
    add(tile.list[i], in, select(in, gaussian(q) * broadcast(s.peak), zero), order);
  }
}

void blendBlockLoop(const TileLists& tile, int block, const float* limits, const float* alpha,
                    const float* values, float* out) {
  const Lanes zero = broadcast(0);
  Lanes sum = zero, sum0 = zero, sum1 = zero, sum2 = zero;
  // What is infinite stays where it is seen: 0 times it would be no number.
  eachWeight(tile, block, limits, [&](uint32_t splat, Mask in, Lanes weight, Lanes) {
    const float* value = values + 4 * static_cast<size_t>(splat);
    sum = sum + weight;
    sum0 = select(in, mulAdd(weight, broadcast(value[0]), sum0), sum0);
    sum1 = select(in, mulAdd(weight, broadcast(value[1]), sum1), sum1);
    sum2 = select(in, mulAdd(weight, broadcast(value[2]), sum2), sum2);
  });
  const Mask any = zero < sum;
  const Lanes scale = select(any, load(alpha) / select(any, sum, broadcast(1)), zero);
  store(out, sum0 * scale);
  store(out + kLanes, sum1 * scale);
  store(out + 2 * kLanes, sum2 * scale);
}

void meanOrderLoop(const TileLists& tile, int block, const float* limits, float* out) {
  const Lanes zero = broadcast(0);
  Lanes sum = zero, sumOfOrders = zero;
  eachWeight(tile, block, limits, [&](uint32_t, Mask, Lanes weight, Lanes order) {
    sum = sum + weight;
    sumOfOrders = mulAdd(weight, order, sumOfOrders);
  });
  store(out, sumOfOrders / select(zero < sum, sum, broadcast(1)));
}

constexpr SplatKernels kernelsOfTheseLanes{projectLoop,     listBlocksLoop, resolveBlockLoop,
                                           gatherPixelLoop, firstLayerLoop, rankPixelLoop,
                                           keepSeenLoop,    blendBlockLoop, meanOrderLoop};

} // namespace
} // namespace surflect
