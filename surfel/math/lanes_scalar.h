// Sixteen floats at a time in plain C++: what lanes_avx2.h and lanes_avx512.h do with their instructions, and
// what processors without them run. A kernel includes one of the three. The compiler's vectors of four are
// those that every processor has, or four floats.
#pragma once

#include <cstdint>

namespace surflect {
namespace {

typedef float FourFloats __attribute__((vector_size(16)));
typedef int32_t FourBools __attribute__((vector_size(16))); // 0 or -1

struct Lanes {
  FourFloats quarter[4];
};
struct Mask {
  FourBools quarter[4];
};

template <class Operation> inline Lanes eachQuarter(Operation operation) {
  return {{operation(0), operation(1), operation(2), operation(3)}};
}
template <class Test> inline Mask eachTest(Test test) { return {{test(0), test(1), test(2), test(3)}}; }
template <class Operation> inline Lanes eachLane(Operation operation) {
  return eachQuarter([&](int k) {
    return FourFloats{operation(4 * k), operation(4 * k + 1), operation(4 * k + 2), operation(4 * k + 3)};
  });
}
inline float at(const Lanes& a, int lane) { return a.quarter[lane / 4][lane % 4]; }

inline Lanes load(const float* from) {
  return eachLane([&](int i) { return from[i]; });
}
// Every sixteenth of the floats.
inline Lanes loadColumn(const float* from) {
  return eachLane([&](int i) { return from[16 * i]; });
}
inline Lanes broadcast(float x) {
  const FourFloats four{x, x, x, x};
  return {{four, four, four, four}};
}
inline void store(float* to, Lanes a) { __builtin_memcpy(to, a.quarter, sizeof a.quarter); }
inline Lanes operator+(Lanes a, Lanes b) {
  return eachQuarter([&](int k) { return a.quarter[k] + b.quarter[k]; });
}
inline Lanes operator-(Lanes a, Lanes b) {
  return eachQuarter([&](int k) { return a.quarter[k] - b.quarter[k]; });
}
inline Lanes operator*(Lanes a, Lanes b) {
  return eachQuarter([&](int k) { return a.quarter[k] * b.quarter[k]; });
}
inline Lanes operator/(Lanes a, Lanes b) {
  return eachQuarter([&](int k) { return a.quarter[k] / b.quarter[k]; });
}
// a b + c; rounded once where there are vector instructions, twice here.
inline Lanes mulAdd(Lanes a, Lanes b, Lanes c) { return a * b + c; }
// c - a b, rounded likewise.
inline Lanes negMulAdd(Lanes a, Lanes b, Lanes c) { return c - a * b; }
inline Lanes sqrt(Lanes a) {
  return eachLane([&](int i) { return __builtin_sqrtf(at(a, i)); });
}
inline Lanes ceil(Lanes a) {
  return eachLane([&](int i) { return __builtin_ceilf(at(a, i)); });
}
inline Mask operator<(Lanes a, Lanes b) {
  return eachTest([&](int k) { return FourBools(a.quarter[k] < b.quarter[k]); });
}
inline Mask operator<=(Lanes a, Lanes b) {
  return eachTest([&](int k) { return FourBools(a.quarter[k] <= b.quarter[k]); });
}
inline Mask operator&(Mask a, Mask b) {
  return eachTest([&](int k) { return a.quarter[k] & b.quarter[k]; });
}
inline Mask andNot(Mask a, Mask b) {
  return eachTest([&](int k) { return a.quarter[k] & ~b.quarter[k]; });
}
// Bit i is that of lane i.
inline uint32_t bitsOf(Mask m) {
  uint32_t bits = 0;
  for (int i = 0; i < 16; ++i) bits |= static_cast<uint32_t>(m.quarter[i / 4][i % 4] & 1) << i;
  return bits;
}
inline Lanes select(Mask m, Lanes a, Lanes b) {
  return eachQuarter([&](int k) {
    const FourBools kept = FourBools(a.quarter[k]) & m.quarter[k],
                    other = FourBools(b.quarter[k]) & ~m.quarter[k];
    return FourFloats(kept | other);
  });
}
// 0 where the mask is not.
inline Lanes where(Mask m, Lanes a) {
  return eachQuarter([&](int k) { return FourFloats(FourBools(a.quarter[k]) & m.quarter[k]); });
}
// The second operand where one is not a number.
inline Lanes min(Lanes a, Lanes b) { return select(a < b, a, b); }
inline Lanes max(Lanes a, Lanes b) { return select(b < a, a, b); }
// The even one of two that are as near; of numbers below 2^22.
inline Lanes nearestWhole(Lanes a) {
  const Lanes shift = broadcast(3 << 22); // floats of this size have no fraction
  return a + shift - shift;
}
// a 2^power for whole powers. Anything where the power or the result is beyond those of normal floats.
inline Lanes timesPowerOfTwo(Lanes a, Lanes power) {
  const Lanes exponent = min(max(power, broadcast(-126)), broadcast(127));
  return eachQuarter([&](int k) {
    const auto factor = (__builtin_convertvector(exponent.quarter[k], FourBools) + 127) << 23;
    return a.quarter[k] * FourFloats(factor);
  });
}
// a where the mask is not.
inline Lanes addWhere(Mask m, Lanes a, Lanes b) { return select(m, a + b, a); }
inline Lanes minWhere(Mask m, Lanes a, Lanes b) { return select(m, min(a, b), a); }
inline Lanes maxWhere(Mask m, Lanes a, Lanes b) { return select(m, max(a, b), a); }
// The lanes of the mask, moved together; may write all of to[0..15].
inline void storeCompressed(float* to, Mask m, Lanes a) {
  for (uint32_t bits = bitsOf(m); bits != 0; bits &= bits - 1) *to++ = at(a, __builtin_ctz(bits));
}

} // namespace
} // namespace surflect
