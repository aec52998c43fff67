// Nearest candidates by penalty, and their ULR weights, for lanes of queries. nearest_sources.cpp derives the
// bounds on rounding.
#include "srf/weights/nearest_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "srf/weights/nearest_kernels.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::weights {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kQueryLanes>;
using Lanes = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
constexpr Tag kTag;
constexpr size_t kWidth = hn::MaxLanes(Tag()); // lanes of a vector; 16 queries take one vector or more

HWY_INLINE Lanes load(const float* from) { return hn::LoadU(kTag, from); }
HWY_INLINE void store(float* to, Lanes x) { hn::StoreU(x, kTag, to); }
HWY_INLINE Lanes number(float x) { return hn::Set(kTag, x); }
HWY_INLINE Lanes infinity() { return number(__builtin_inff()); }
HWY_INLINE uint32_t bitsOf(Mask mask) {
  uint8_t bits[8]{};
  hn::StoreMaskBits(kTag, mask, bits);
  return static_cast<uint32_t>(bits[0] | bits[1] << 8);
}
constexpr uint32_t kAllBits = (uint32_t{1} << kWidth) - 1;

struct Vector {
  Lanes x, y, z;
};
HWY_INLINE Vector loadVector(const float* from) { return {load(from), load(from + 16), load(from + 32)}; }
HWY_INLINE Vector vectorOf(const float* v) { return {number(v[0]), number(v[1]), number(v[2])}; }
HWY_INLINE Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
HWY_INLINE Lanes dot(const Vector& a, const Vector& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, a.z * b.z));
}
// |a - b|^2 / 2
HWY_INLINE Lanes penaltyOf(const Vector& a, const Vector& b) {
  const Vector d = a - b;
  return number(0.5f) * dot(d, d);
}
// Squared lengths for which single precision keeps the direction.
HWY_INLINE Mask isSafe(Lanes squared) { return hn::And(number(1e-30f) < squared, squared < number(1e30f)); }

uint32_t writeDirections(const SplitSource* sources, const uint32_t* which, size_t count, const float* places,
                         float* towards) {
  uint32_t lost = 0;
  for (size_t lane = 0; lane < kQueryLanes; lane += kWidth) {
    const Vector p = loadVector(places + lane);
    Mask safe = number(0) < number(1);
    float* to = towards + lane;
    for (size_t c = 0; c < count; ++c, to += 48) {
      const SplitSource& source = sources[which ? which[c] : c];
      const Vector place{number(source.x), number(source.y), number(source.z)};
      if (source.isDistant) {
        store(to, place.x);
        store(to + 16, place.y);
        store(to + 32, place.z);
        continue;
      }
      const Vector first = place - p;
      const Vector d{first.x + number(source.restX), first.y + number(source.restY),
                     first.z + number(source.restZ)};
      const Lanes squared = dot(d, d), scale = number(1) / hn::Sqrt(squared);
      safe = hn::And(safe, isSafe(squared));
      store(to, scale * d.x);
      store(to + 16, scale * d.y);
      store(to + 32, scale * d.z);
    }
    lost |= (bitsOf(safe) ^ kAllBits) << lane;
  }
  return lost;
}

void writeLargestPenalties(const float* candidates, const uint32_t* which, size_t count, const float* towards,
                           float* penalties) {
  for (size_t lane = 0; lane < kQueryLanes; lane += kWidth) {
    const Vector asked = loadVector(towards + lane);
    Lanes largest = number(0);
    for (size_t c = 0; c < count; ++c) {
      const Lanes penalty = penaltyOf(loadVector(candidates + 48 * which[c] + lane), asked);
      largest = hn::Max(largest, hn::IfThenElse(penalty < infinity(), penalty, infinity()));
    }
    store(penalties + lane, largest);
  }
}

// The n smallest penalties inserted so far with their indices, kept in registers as far as possible.
template <int n> struct Sorted {
  Lanes penalty, index;
  Sorted<n - 1> rest;

  HWY_INLINE void clear() {
    penalty = infinity();
    index = number(0);
    rest.clear();
  }
  HWY_INLINE void insert(Lanes ofPenalty, Lanes ofIndex) {
    const Mask isNearer = ofPenalty < penalty;
    const Lanes farther = hn::IfThenElse(isNearer, penalty, ofPenalty),
                fartherIndex = hn::IfThenElse(isNearer, index, ofIndex);
    penalty = hn::IfThenElse(isNearer, ofPenalty, penalty);
    index = hn::IfThenElse(isNearer, ofIndex, index);
    rest.insert(farther, fartherIndex);
  }
  HWY_INLINE Lanes largest() const { return rest.largest(); }
  HWY_INLINE void storeTo(float* penalties, float* indices) const {
    store(penalties, penalty);
    store(indices, index);
    rest.storeTo(penalties + kQueryLanes, indices + kQueryLanes);
  }
};
template <> struct Sorted<0> {
  HWY_INLINE void clear() {}
  HWY_INLINE void insert(Lanes, Lanes) {}
  HWY_INLINE void storeTo(float*, float*) const {}
};
template <> HWY_INLINE Lanes Sorted<1>::largest() const { return penalty; }

// Least cosine of unit vectors whose penalty is within the limit: 1 - limit, minus a margin for rounding.
HWY_INLINE Lanes leastCosine(Lanes limit) { return number(1 - 4e-6f) - limit; }

template <int slots>
HWY_INLINE void nearestOf(const float* candidates, const uint32_t* which, const float* inverseFades,
                          size_t count, const float* towards, const float* limits, float* penalties,
                          float* indices) {
  const Vector asked = loadVector(towards);
  const Lanes limit = load(limits);
  Lanes least = leastCosine(limit);
  Sorted<slots> sorted;
  sorted.clear();
  for (size_t c = 0; c < count; ++c, candidates += 48) {
    // Most candidates are too far away. The angle alone shows this, since no fade exceeds 1.
    const Vector candidate = loadVector(candidates);
    if (hn::AllFalse(kTag, least <= dot(candidate, asked))) continue;
    Lanes penalty = penaltyOf(candidate, asked);
    if (inverseFades) penalty = penalty * load(inverseFades + 16 * c);
    // False for infinite and NaN penalties.
    if (hn::AllFalse(kTag, hn::And(penalty <= limit, penalty < sorted.largest()))) continue;
    sorted.insert(penalty, number(static_cast<float>(which ? which[c] : static_cast<uint32_t>(c))));
    least = leastCosine(hn::Min(limit, sorted.largest()));
  }
  sorted.storeTo(penalties, indices);
}

void findNearest(const float* candidates, const uint32_t* which, const float* inverseFades, size_t count,
                 const float* towards, const float* limits, size_t slots, NearestOfQueries& nearest) {
  for (size_t lane = 0; lane < kQueryLanes; lane += kWidth) {
    const auto find = slots <= 5 ? nearestOf<5> : slots <= 9 ? nearestOf<9> : nearestOf<kMaxNearest>;
    find(candidates + lane, which, inverseFades ? inverseFades + lane : nullptr, count, towards + lane,
         limits + lane, *nearest.penalty + lane, *nearest.index + lane);
  }
}

size_t findInCone(const float* x, const float* y, const float* z, const float* isNear, size_t groups,
                  const SourceCone& cone, uint32_t* found) {
  const Vector p{number(-cone.place[0]), number(-cone.place[1]), number(-cone.place[2])},
      towards = vectorOf(cone.towards);
  const float s = cone.least;
  const Lanes leastSquared = number(s < 0 ? -s * s : s * s), least = number(1e-29f);
  size_t count = 0;
  for (size_t i = 0; i < groups * kQueryLanes; i += kWidth) {
    const Lanes near = load(isNear + i);
    const Vector d{hn::MulAdd(near, p.x, load(x + i)), hn::MulAdd(near, p.y, load(y + i)),
                   hn::MulAdd(near, p.z, load(z + i))};
    const Lanes squared = dot(d, d), along = dot(d, towards);
    // along / |d| < least, compared by signed squares; false for NaN.
    const Mask isBeyond = hn::And(least < squared, along * hn::Abs(along) < leastSquared * squared);
    for (uint32_t bits = bitsOf(isBeyond) ^ kAllBits; bits != 0; bits &= bits - 1)
      found[count++] = static_cast<uint32_t>(i) + static_cast<uint32_t>(__builtin_ctz(bits));
  }
  return count;
}

// Same operations in the same order as ulrWeights, except that the threshold is inverted once.
HWY_INLINE void weightsOf(const float* penalties, size_t count, float* weights) {
  const Lanes zero = number(0), one = number(1), floor = number(1e-12f), first = load(penalties);
  const Lanes threshold = hn::Min(load(penalties + 16 * count), hn::Max(one, first + first)),
              inverse = one / threshold;
  Lanes sum = zero;
  for (size_t i = 0; i < count; ++i) {
    const Lanes p = hn::Max(load(penalties + 16 * i), floor);
    // exactly 0 for an infinite p and for the threshold itself
    const Lanes relevance = hn::IfThenElseZero(p < threshold, hn::Max(one - p * inverse, zero) / p);
    store(weights + 16 * i, relevance);
    sum = sum + relevance;
  }
  const Mask isWeighed = zero < sum;
  if (!hn::AllTrue(kTag, isWeighed)) { // all penalties equal the threshold, or there are none
    Lanes equals = zero;
    for (size_t i = 0; i < count; ++i) {
      const Lanes penalty = load(penalties + 16 * i);
      const Lanes share = hn::IfThenElseZero(hn::And(penalty <= first, penalty < infinity()), one);
      const Lanes weight = hn::IfThenElse(isWeighed, load(weights + 16 * i), share);
      store(weights + 16 * i, weight);
      equals = equals + share;
    }
    sum = hn::IfThenElse(isWeighed, sum, hn::Max(equals, one));
  }
  for (size_t i = 0; i < count; ++i) store(weights + 16 * i, load(weights + 16 * i) / sum); // 1 if alone
}

// As truncated of ulr.h, for weights in lanes that sum to 1, or are all 0.
HWY_INLINE void truncateWeights(size_t count, float error, float* weights) {
  const Lanes zero = number(0), one = number(1), two = number(2), tiny = number(1e-30f),
              inverse = number(1.5f / error);
  Lanes kept[kMaxNearest], sum = zero;
  for (size_t i = 0; i < count; ++i) {
    const Lanes weight = load(weights + 16 * i), scale = one / hn::Max(weight, tiny);
    Lanes c = zero;
    for (size_t j = 0; j < count; ++j) {
      const Lanes other = load(weights + 16 * j);
      c = hn::MulAdd(other, hn::Min(hn::Max(two - other * scale, zero), one), c);
    }
    kept[i] = weight * hn::Min(hn::Max(hn::MulSub(c, inverse, one), zero), one);
    sum = sum + kept[i];
  }
  const Lanes scale = one / hn::Max(sum, tiny);
  for (size_t i = 0; i < count; ++i) store(weights + 16 * i, kept[i] * scale);
}

void writeWeights(const NearestOfQueries& nearest, size_t count, float error, float* weights) {
  for (size_t lane = 0; lane < kQueryLanes; lane += kWidth) {
    weightsOf(*nearest.penalty + lane, count, weights + lane);
    if (error > 0) truncateWeights(count, error, weights + lane);
  }
}

HWY_INLINE Lanes withSignOf(Lanes sign, Lanes x) {
  return hn::IfThenElse(sign < number(0), number(0) - x, x);
}

// d / (|x| + |y| + |z|); for z < 0, a becomes (1 - |b|) sign a, and b likewise.  [Praun, Hoppe 2003]
void findCells(const float* directions, size_t groups, const float* rotation, size_t cells, float* cell,
               float* right, float* down) {
  const auto side = static_cast<float>(cells);
  const Lanes zero = number(0), one = number(1), half = number(side / 2), across = number(side),
              last = number(side - 1);
  const Vector column[3]{vectorOf(rotation), vectorOf(rotation + 3), vectorOf(rotation + 6)};
  for (size_t i = 0; i < groups * kQueryLanes; i += kWidth) {
    const Vector d = loadVector(directions + i / kQueryLanes * 48 + i % kQueryLanes);
    const Vector t{hn::MulAdd(column[0].x, d.x, hn::MulAdd(column[1].x, d.y, column[2].x * d.z)),
                   hn::MulAdd(column[0].y, d.x, hn::MulAdd(column[1].y, d.y, column[2].y * d.z)),
                   hn::MulAdd(column[0].z, d.x, hn::MulAdd(column[1].z, d.y, column[2].z * d.z))};
    const Lanes scale = one / (hn::Abs(t.x) + hn::Abs(t.y) + hn::Abs(t.z)), a = scale * t.x, b = scale * t.y;
    const Mask isBelow = t.z < zero;
    const Lanes foldedA = withSignOf(a, one - hn::Abs(b)), foldedB = withSignOf(b, one - hn::Abs(a));
    const Lanes u = hn::MulAdd(hn::IfThenElse(isBelow, foldedA, a), half, half),
                v = hn::MulAdd(hn::IfThenElse(isBelow, foldedB, b), half, half);
    const Lanes h = hn::Min(hn::Max(hn::Floor(u), zero), last),
                w = hn::Min(hn::Max(hn::Floor(v), zero), last);
    store(cell + i, hn::MulAdd(w, across, h));
    store(right + i, u - h);
    store(down + i, v - w);
  }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::weights
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::weights {

HWY_EXPORT(writeDirections);
HWY_EXPORT(writeLargestPenalties);
HWY_EXPORT(findNearest);
HWY_EXPORT(findInCone);
HWY_EXPORT(writeWeights);
HWY_EXPORT(findCells);

uint32_t writeDirections(const SplitSource* sources, const uint32_t* which, size_t count, const float* places,
                         float* towards) {
  return HWY_DYNAMIC_DISPATCH(writeDirections)(sources, which, count, places, towards);
}
void writeLargestPenalties(const float* candidates, const uint32_t* which, size_t count, const float* towards,
                           float* penalties) {
  HWY_DYNAMIC_DISPATCH(writeLargestPenalties)(candidates, which, count, towards, penalties);
}
void findNearest(const float* candidates, const uint32_t* which, const float* inverseFades, size_t count,
                 const float* towards, const float* limits, size_t slots, NearestOfQueries& nearest) {
  HWY_DYNAMIC_DISPATCH(findNearest)(candidates, which, inverseFades, count, towards, limits, slots, nearest);
}
size_t findInCone(const float* x, const float* y, const float* z, const float* isNear, size_t groups,
                  const SourceCone& cone, uint32_t* found) {
  return HWY_DYNAMIC_DISPATCH(findInCone)(x, y, z, isNear, groups, cone, found);
}
void writeWeights(const NearestOfQueries& nearest, size_t count, float error, float* weights) {
  HWY_DYNAMIC_DISPATCH(writeWeights)(nearest, count, error, weights);
}
void findCells(const float* directions, size_t groups, const float* rotation, size_t cells, float* cell,
               float* right, float* down) {
  HWY_DYNAMIC_DISPATCH(findCells)(directions, groups, rotation, cells, cell, right, down);
}

} // namespace surflect::weights
#endif
