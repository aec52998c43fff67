// Sixteen floats at a time, in plain loops: what lanes_avx2.h and lanes_avx512.h do with vector instructions,
// and what processors without them run. A kernel includes one of the three.
#pragma once

#include <cstdint>

namespace surflect {
namespace {

struct Lanes {
  float at[16];
};
struct Mask { // of lanes, all bits or none
  int32_t at[16];
};

template <class Operation> inline Lanes eachLane(Operation operation) {
  Lanes r;
  for (int i = 0; i < 16; ++i) r.at[i] = operation(i);
  return r;
}
template <class Test> inline Mask eachTest(Test test) {
  Mask m;
  for (int i = 0; i < 16; ++i) m.at[i] = -static_cast<int32_t>(test(i));
  return m;
}

inline Lanes load(const float* from) {
  return eachLane([&](int i) { return from[i]; });
}
// Every sixteenth of the floats.
inline Lanes loadColumn(const float* from) {
  return eachLane([&](int i) { return from[16 * i]; });
}
inline Lanes broadcast(float x) {
  return eachLane([&](int) { return x; });
}
inline void store(float* to, Lanes a) {
  for (int i = 0; i < 16; ++i) to[i] = a.at[i];
}
inline Lanes operator+(Lanes a, Lanes b) {
  return eachLane([&](int i) { return a.at[i] + b.at[i]; });
}
inline Lanes operator-(Lanes a, Lanes b) {
  return eachLane([&](int i) { return a.at[i] - b.at[i]; });
}
inline Lanes operator*(Lanes a, Lanes b) {
  return eachLane([&](int i) { return a.at[i] * b.at[i]; });
}
inline Lanes operator/(Lanes a, Lanes b) {
  return eachLane([&](int i) { return a.at[i] / b.at[i]; });
}
// a b + c; rounded once where there are vector instructions, twice here.
inline Lanes mulAdd(Lanes a, Lanes b, Lanes c) {
  return eachLane([&](int i) { return a.at[i] * b.at[i] + c.at[i]; });
}
// The second operand where one is not a number.
inline Lanes min(Lanes a, Lanes b) {
  return eachLane([&](int i) { return a.at[i] < b.at[i] ? a.at[i] : b.at[i]; });
}
inline Lanes max(Lanes a, Lanes b) {
  return eachLane([&](int i) { return a.at[i] > b.at[i] ? a.at[i] : b.at[i]; });
}
inline Lanes sqrt(Lanes a) {
  return eachLane([&](int i) { return __builtin_sqrtf(a.at[i]); });
}
inline Lanes ceil(Lanes a) {
  return eachLane([&](int i) { return __builtin_ceilf(a.at[i]); });
}
inline Mask operator<(Lanes a, Lanes b) {
  return eachTest([&](int i) { return a.at[i] < b.at[i]; });
}
inline Mask operator<=(Lanes a, Lanes b) {
  return eachTest([&](int i) { return a.at[i] <= b.at[i]; });
}
inline Mask operator&(Mask a, Mask b) {
  return eachTest([&](int i) { return (a.at[i] & b.at[i]) != 0; });
}
inline Mask operator|(Mask a, Mask b) {
  return eachTest([&](int i) { return (a.at[i] | b.at[i]) != 0; });
}
inline Mask andNot(Mask a, Mask b) {
  return eachTest([&](int i) { return (a.at[i] & ~b.at[i]) != 0; });
}
inline uint32_t bitsOf(Mask m) {
  uint32_t bits = 0;
  for (int i = 0; i < 16; ++i) bits |= static_cast<uint32_t>(m.at[i] & 1) << i;
  return bits;
}
inline Lanes select(Mask m, Lanes a, Lanes b) {
  return eachLane([&](int i) { return m.at[i] ? a.at[i] : b.at[i]; });
}
// a where the mask is not.
inline Lanes addWhere(Mask m, Lanes a, Lanes b) { return select(m, a + b, a); }
inline Lanes minWhere(Mask m, Lanes a, Lanes b) { return select(m, min(a, b), a); }
inline Lanes maxWhere(Mask m, Lanes a, Lanes b) { return select(m, max(a, b), a); }
// The lanes of the mask, moved together; may write all of to[0..15].
inline void storeCompressed(float* to, Mask m, Lanes a) {
  for (int i = 0, n = 0; i < 16; ++i)
    if (m.at[i]) to[n++] = a.at[i];
}

} // namespace
} // namespace surflect
