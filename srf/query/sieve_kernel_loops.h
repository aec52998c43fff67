// The loops of sieve_kernels.h, in the lanes that the compiler was told to use. Their bounds are derived in
// candidate_sieve.cpp.
#pragma once

#include "srf/query/sieve_kernels.h"
#include "surfel/lanes.h"

namespace surflect {
namespace {

// One step of Newton's from the estimate.
inline Lanes inverseRoot(Lanes a) {
  const Lanes estimate = inverseRootEstimate(a);
  return estimate * (broadcast(1.5f) - broadcast(0.5f) * a * (estimate * estimate));
}

inline bool lookFrom(const SieveSources& sources, const float* place, float fromMiddle,
                     const SieveDirections& towards) {
  const Lanes px = broadcast(-place[0]), py = broadcast(-place[1]), pz = broadcast(-place[2]);
  const Lanes smallest = broadcast(1e-30f), largest = broadcast(1e30f);
  Mask isSafe = smallest < largest;
  for (size_t i = 0; i < sources.groups * kSieveLanes; i += kSieveLanes) {
    const Lanes isNear = load(sources.isNear + i);
    const Lanes x = mulAdd(isNear, px, load(sources.x + i)), y = mulAdd(isNear, py, load(sources.y + i)),
                z = mulAdd(isNear, pz, load(sources.z + i));
    const Lanes squared = mulAdd(x, x, mulAdd(y, y, z * z));
    const Lanes far =
        broadcast(kSieveNearest) * mulAdd(isNear, broadcast(fromMiddle), load(sources.fromMiddle + i));
    isSafe = isSafe & (far * far <= squared) & (smallest < squared) & (squared < largest);
    const Lanes scale = inverseRoot(squared);
    store(towards.x + i, scale * x);
    store(towards.y + i, scale * y);
    store(towards.z + i, scale * z);
  }
  return bitsOf(isSafe) == 0xffff;
}

// A value that `wanted` of those of a and b do not exceed, and few more; infinity if there are not as many.
inline float valueBeyond(Lanes a, Lanes b, size_t wanted) {
  const bool oneIsEnough = wanted <= kSieveLanes / 2;
  if (oneIsEnough) a = min(a, b);
  float values[2 * kSieveLanes];
  store(values, a);
  store(values + kSieveLanes, b);
  float least = __builtin_inff();
  for (size_t i = 0; i < (oneIsEnough ? 1 : 2) * kSieveLanes; ++i) {
    const Lanes limit = broadcast(values[i]);
    const uint32_t within = bitsOf(a <= limit) | (oneIsEnough ? 0 : bitsOf(b <= limit) << kSieveLanes);
    const bool isEnough = static_cast<size_t>(__builtin_popcount(within)) >= wanted;
    least = isEnough && values[i] < least ? values[i] : least;
  }
  return least;
}

inline size_t nearest(const SieveDirections& towards, size_t groups, const SieveQuery& query, float* bounds,
                      uint32_t* found) {
  const Lanes qx = broadcast(query.x), qy = broadcast(query.y), qz = broadcast(query.z);
  const Lanes slack = broadcast(query.slack), half = broadcast(0.5f), never = broadcast(__builtin_nanf(""));
  const Lanes coarse = load(query.coarse), fine = load(query.fine);
  // Least upper bounds on a penalty, of the sources that are so many places apart; each is another's.
  Lanes least[2] = {broadcast(__builtin_inff()), broadcast(__builtin_inff())};
  for (size_t g = 0; g < groups; ++g) {
    const size_t i = g * kSieveLanes;
    const Bytes fade = loadBytes(query.fades + i);
    const Mask isSeen = isPositive(fade);
    if (bitsOf(isSeen) == 0) {
      store(bounds + i, never);
      continue;
    }
    const Lanes x = load(towards.x + i) - qx, y = load(towards.y + i) - qy, z = load(towards.z + i) - qz;
    const Lanes penalty = half * mulAdd(x, x, mulAdd(y, y, z * z));
    const Lanes overFade = pick(coarse, sixteenthOf(fade)) * pick(fine, fade);
    store(bounds + i, select(isSeen, (penalty - slack) * overFade, never));
    least[g % 2] = minWhere(isSeen, least[g % 2], (penalty + slack) * overFade);
  }
  constexpr float kRounding = 1 + 4e-6f; // of both bounds' factors
  const Lanes limit = broadcast(kRounding * valueBeyond(least[0], least[1], query.wanted));
  size_t count = 0;
  for (size_t g = 0; g < groups; ++g)
    for (uint32_t bits = bitsOf(load(bounds + g * kSieveLanes) <= limit); bits != 0; bits &= bits - 1)
      found[count++] = static_cast<uint32_t>(g * kSieveLanes) + static_cast<uint32_t>(__builtin_ctz(bits));
  return count;
}

constexpr SieveKernels kernelsOfTheseLanes{lookFrom, nearest};

} // namespace
} // namespace surflect
