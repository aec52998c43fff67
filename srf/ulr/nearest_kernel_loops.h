// Vector loops of nearest_kernels.h, for the instruction set of the including file. nearest_sources.cpp
// derives their error bounds.
#pragma once

#include "srf/ulr/nearest_kernels.h"
#include "surfel/math/lanes.h"

namespace surflect::ulr {
namespace {

inline Lanes infinity() { return broadcast(__builtin_inff()); }
inline Lanes absolute(Lanes x) { return max(x, broadcast(0) - x); }
inline Mask everywhere() { return broadcast(0) < broadcast(1); }

inline uint32_t face(const SplitSource* sources, const uint32_t* which, size_t count, const float* places,
                     float* towards) {
  const Lanes px = load(places), py = load(places + 16), pz = load(places + 32), one = broadcast(1);
  const Lanes least = broadcast(1e-30f), most = broadcast(1e30f);
  Mask isSafe = everywhere();
  for (size_t c = 0; c < count; ++c, towards += 48) {
    const SplitSource& source = sources[which ? which[c] : c];
    if (source.isDistant) {
      store(towards, broadcast(source.x));
      store(towards + 16, broadcast(source.y));
      store(towards + 32, broadcast(source.z));
      continue;
    }
    const Lanes x = broadcast(source.x) - px + broadcast(source.restX),
                y = broadcast(source.y) - py + broadcast(source.restY),
                z = broadcast(source.z) - pz + broadcast(source.restZ);
    const Lanes squared = mulAdd(x, x, mulAdd(y, y, z * z));
    isSafe = isSafe & (least < squared) & (squared < most);
    const Lanes scale = one / sqrt(squared);
    store(towards, scale * x);
    store(towards + 16, scale * y);
    store(towards + 32, scale * z);
  }
  return bitsOf(isSafe) ^ 0xffffu;
}

// |a - b|^2 / 2
inline Lanes penaltyOf(const float* candidate, Lanes x, Lanes y, Lanes z) {
  const Lanes dx = load(candidate) - x, dy = load(candidate + 16) - y, dz = load(candidate + 32) - z;
  return broadcast(0.5f) * mulAdd(dx, dx, mulAdd(dy, dy, dz * dz));
}

inline void farthest(const float* candidates, const uint32_t* which, size_t count, const float* towards,
                     float* penalties) {
  const Lanes x = load(towards), y = load(towards + 16), z = load(towards + 32);
  Lanes largest = broadcast(0);
  for (size_t c = 0; c < count; ++c) {
    const Lanes penalty = penaltyOf(candidates + 48 * which[c], x, y, z);
    largest = max(largest, select(penalty < infinity(), penalty, infinity()));
  }
  store(penalties, largest);
}

// The n smallest penalties inserted so far with their indices, kept in registers as far as these suffice.
template <int n> struct Sorted {
  Lanes penalty = infinity(), index = broadcast(0);
  Sorted<n - 1> rest;

  inline void insert(Lanes ofPenalty, Lanes ofIndex) {
    const Mask isNearer = ofPenalty < penalty;
    const Lanes farther = select(isNearer, penalty, ofPenalty),
                fartherIndex = select(isNearer, index, ofIndex);
    penalty = select(isNearer, ofPenalty, penalty);
    index = select(isNearer, ofIndex, index);
    rest.insert(farther, fartherIndex);
  }
  inline Lanes largest() const { return rest.largest(); }
  inline void take(float (*penalties)[16], float (*indices)[16]) const {
    store(*penalties, penalty);
    store(*indices, index);
    rest.take(penalties + 1, indices + 1);
  }
};
template <> struct Sorted<1> {
  Lanes penalty = infinity(), index = broadcast(0);

  inline void insert(Lanes ofPenalty, Lanes ofIndex) {
    const Mask isNearer = ofPenalty < penalty;
    penalty = select(isNearer, ofPenalty, penalty);
    index = select(isNearer, ofIndex, index);
  }
  inline Lanes largest() const { return penalty; }
  inline void take(float (*penalties)[16], float (*indices)[16]) const {
    store(*penalties, penalty);
    store(*indices, index);
  }
};

// Least cosine of unit vectors whose penalty is within the limit: 1 - limit, less rounding.
inline Lanes leastCosine(Lanes limit) { return broadcast(1 - 4e-6f) - limit; }

template <int slots>
inline void nearestOf(const float* candidates, const uint32_t* which, const float* inverseFades, size_t count,
                      const float* towards, const float* limits, NearestOfQueries* nearest) {
  const Lanes x = load(towards), y = load(towards + 16), z = load(towards + 32);
  const Lanes limit = load(limits);
  Lanes least = leastCosine(limit);
  Sorted<slots> sorted;
  for (size_t c = 0; c < count; ++c, candidates += 48) {
    // Most are too far away; as no fade exceeds 1, the angle alone shows it.
    const Lanes cosine =
        mulAdd(load(candidates), x, mulAdd(load(candidates + 16), y, load(candidates + 32) * z));
    if (bitsOf(least <= cosine) == 0) continue;
    Lanes penalty = penaltyOf(candidates, x, y, z);
    if (inverseFades) penalty = penalty * load(inverseFades + 16 * c);
    // Infinite and NaN penalties are never below the largest.
    if (bitsOf((penalty <= limit) & (penalty < sorted.largest())) == 0) continue;
    sorted.insert(penalty, broadcast(static_cast<float>(which ? which[c] : static_cast<uint32_t>(c))));
    least = leastCosine(min(limit, sorted.largest()));
  }
  sorted.take(nearest->penalty, nearest->index);
}

inline void nearest(const float* candidates, const uint32_t* which, const float* inverseFades, size_t count,
                    const float* towards, const float* limits, size_t slots, NearestOfQueries* nearest) {
  if (slots <= 5)
    nearestOf<5>(candidates, which, inverseFades, count, towards, limits, nearest);
  else if (slots <= 9)
    nearestOf<9>(candidates, which, inverseFades, count, towards, limits, nearest);
  else
    nearestOf<kMaxNearest>(candidates, which, inverseFades, count, towards, limits, nearest);
}

inline size_t within(const float* x, const float* y, const float* z, const float* isNear, size_t groups,
                     const SourceCone& cone, uint32_t* found) {
  const Lanes px = broadcast(-cone.place[0]), py = broadcast(-cone.place[1]), pz = broadcast(-cone.place[2]);
  const Lanes qx = broadcast(cone.towards[0]), qy = broadcast(cone.towards[1]),
              qz = broadcast(cone.towards[2]);
  const float s = cone.least;
  const Lanes leastSquared = broadcast(s < 0 ? -s * s : s * s), least = broadcast(1e-29f);
  size_t count = 0;
  for (size_t i = 0; i < groups * kQueryLanes; i += kQueryLanes) {
    const Lanes near = load(isNear + i);
    const Lanes dx = mulAdd(near, px, load(x + i)), dy = mulAdd(near, py, load(y + i)),
                dz = mulAdd(near, pz, load(z + i));
    const Lanes squared = mulAdd(dx, dx, mulAdd(dy, dy, dz * dz)),
                along = mulAdd(dx, qx, mulAdd(dy, qy, dz * qz));
    // along / |d| < least, compared by signed squares; false for NaN.
    const Mask isBeyond = (least < squared) & (along * absolute(along) < leastSquared * squared);
    for (uint32_t bits = bitsOf(isBeyond) ^ 0xffffu; bits != 0; bits &= bits - 1)
      found[count++] = static_cast<uint32_t>(i) + static_cast<uint32_t>(__builtin_ctz(bits));
  }
  return count;
}

inline void look(const float* x, const float* y, const float* z, const float* rest, const float* isNear,
                 size_t groups, const float* query, float* penalties, float* cosines) {
  const Lanes px = broadcast(-query[0]), py = broadcast(-query[1]), pz = broadcast(-query[2]);
  const Lanes qx = broadcast(query[3]), qy = broadcast(query[4]), qz = broadcast(query[5]);
  const Lanes nx = broadcast(query[6]), ny = broadcast(query[7]), nz = broadcast(query[8]);
  const Lanes least = broadcast(1e-30f), most = broadcast(1e30f), zero = broadcast(0), half = broadcast(0.5f);
  const size_t count = groups * kQueryLanes;
  for (size_t i = 0; i < count; i += kQueryLanes) {
    const Lanes near = load(isNear + i);
    const Lanes dx = mulAdd(near, px, load(x + i)) + load(rest + i),
                dy = mulAdd(near, py, load(y + i)) + load(rest + count + i),
                dz = mulAdd(near, pz, load(z + i)) + load(rest + 2 * count + i);
    const Lanes squared = mulAdd(dx, dx, mulAdd(dy, dy, dz * dz)), scale = broadcast(1) / sqrt(squared);
    const Mask isSafe = (least < squared) & (squared < most);
    const Lanes ux = scale * dx, uy = scale * dy, uz = scale * dz;
    const Lanes ex = ux - qx, ey = uy - qy, ez = uz - qz;
    store(penalties + i, select(isSafe, half * mulAdd(ex, ex, mulAdd(ey, ey, ez * ez)), zero));
    store(cosines + i, select(isSafe, mulAdd(ux, nx, mulAdd(uy, ny, uz * nz)), zero));
  }
}

// Same operations in the same order as ulrWeights, except that the threshold is inverted once.
inline uint32_t weigh(const NearestOfQueries& nearest, size_t count, float* weights) {
  const Lanes zero = broadcast(0), one = broadcast(1), floor = broadcast(1e-12f),
              first = load(*nearest.penalty);
  const Lanes threshold = min(load(nearest.penalty[count]), max(one, first + first)),
              inverse = one / threshold;
  Lanes sum = zero, smallest = infinity();
  for (size_t i = 0; i < count; ++i) {
    const Lanes p = max(load(nearest.penalty[i]), floor);
    // exactly 0 for an infinite p and for the threshold itself
    const Lanes relevance = select(p < threshold, max(one - p * inverse, zero) / p, zero);
    store(weights + 16 * i, relevance);
    sum = sum + relevance;
    smallest = min(relevance, smallest);
  }
  const Mask isWeighed = zero < sum;
  if (bitsOf(isWeighed) != 0xffff) { // all penalties equal the threshold, or there are none
    Lanes equals = zero;
    smallest = infinity();
    for (size_t i = 0; i < count; ++i) {
      const Lanes penalty = load(nearest.penalty[i]);
      const Lanes share = select((penalty <= first) & (penalty < infinity()), one, zero);
      const Lanes weight = select(isWeighed, load(weights + 16 * i), share);
      store(weights + 16 * i, weight);
      equals = equals + share;
      smallest = min(weight, smallest);
    }
    sum = select(isWeighed, sum, max(equals, one));
  }
  for (size_t i = 0; i < count; ++i) store(weights + 16 * i, load(weights + 16 * i) / sum); // 1 if alone
  return bitsOf(zero < smallest);
}

inline Lanes floor(Lanes x) { return broadcast(0) - ceil(broadcast(0) - x); }
inline Lanes withSignOf(Lanes sign, Lanes x) { return select(sign < broadcast(0), broadcast(0) - x, x); }

// d / (|x| + |y| + |z|); for z < 0, a becomes (1 - |b|) sign a, and b likewise.  [Praun, Hoppe 2003]
inline void unfold(const float* directions, size_t groups, const float* turn, size_t cells, float* cell,
                   float* right, float* down) {
  const auto side = static_cast<float>(cells);
  const Lanes zero = broadcast(0), one = broadcast(1), half = broadcast(side / 2), across = broadcast(side),
              last = broadcast(side - 1);
  for (size_t g = 0; g < groups; ++g, directions += 48, cell += 16, right += 16, down += 16) {
    const Lanes dx = load(directions), dy = load(directions + 16), dz = load(directions + 32);
    const auto row = [&](int r) {
      return mulAdd(broadcast(turn[r]), dx, mulAdd(broadcast(turn[r + 3]), dy, broadcast(turn[r + 6]) * dz));
    };
    const Lanes x = row(0), y = row(1), z = row(2);
    const Lanes scale = one / (absolute(x) + absolute(y) + absolute(z)), a = scale * x, b = scale * y;
    const Mask isBelow = z < zero;
    const Lanes u = mulAdd(select(isBelow, withSignOf(a, one - absolute(b)), a), half, half),
                v = mulAdd(select(isBelow, withSignOf(b, one - absolute(a)), b), half, half);
    const Lanes column = min(max(floor(u), zero), last), line = min(max(floor(v), zero), last);
    store(cell, mulAdd(line, across, column));
    store(right, u - column);
    store(down, v - line);
  }
}

constexpr NearestKernels kernelsOfTheseLanes{face, farthest, nearest, within, look, weigh, unfold};

} // namespace
} // namespace surflect::ulr
