// Eight doubles at a time in plain C++: what double_lanes_avx2.h and double_lanes_avx512.h do with their
// instructions, and what processors without them run. A kernel includes one of the three. The compiler's
// vectors of two are those that every processor has, or two doubles.
#pragma once

#include <cstdint>

namespace surflect {
namespace {

typedef double TwoDoubles __attribute__((vector_size(16)));

struct DoubleLanes {
  TwoDoubles pair[4];

  DoubleLanes() = default;
  DoubleLanes(TwoDoubles a, TwoDoubles b, TwoDoubles c, TwoDoubles d) : pair{a, b, c, d} {}
  DoubleLanes(double x) : pair{{x, x}, {x, x}, {x, x}, {x, x}} {}
};

template <class Operation> inline DoubleLanes eachPair(Operation operation) {
  return {operation(0), operation(1), operation(2), operation(3)};
}
template <class Operation> inline DoubleLanes eachDouble(Operation operation) {
  return eachPair([&](int k) { return TwoDoubles{operation(2 * k), operation(2 * k + 1)}; });
}
inline double at(const DoubleLanes& x, int lane) { return x.pair[lane / 2][lane % 2]; }

inline DoubleLanes load(const double* from) {
  return eachDouble([&](int i) { return from[i]; });
}
inline void store(double* to, DoubleLanes x) { __builtin_memcpy(to, x.pair, sizeof x.pair); }
inline DoubleLanes operator+(DoubleLanes x, DoubleLanes y) {
  return eachPair([&](int k) { return x.pair[k] + y.pair[k]; });
}
inline DoubleLanes operator-(DoubleLanes x, DoubleLanes y) {
  return eachPair([&](int k) { return x.pair[k] - y.pair[k]; });
}
inline DoubleLanes operator*(DoubleLanes x, DoubleLanes y) {
  return eachPair([&](int k) { return x.pair[k] * y.pair[k]; });
}
inline DoubleLanes operator/(DoubleLanes x, DoubleLanes y) {
  return eachPair([&](int k) { return x.pair[k] / y.pair[k]; });
}
// x y + z; rounded once where there are vector instructions, twice here.
inline DoubleLanes mulAdd(DoubleLanes x, DoubleLanes y, DoubleLanes z) { return x * y + z; }
// z - x y, likewise.
inline DoubleLanes minusProduct(DoubleLanes z, DoubleLanes x, DoubleLanes y) { return z - x * y; }
// The second operand where one is not a number.
inline DoubleLanes min(DoubleLanes x, DoubleLanes y) {
  return eachDouble([&](int i) { return at(x, i) < at(y, i) ? at(x, i) : at(y, i); });
}
inline DoubleLanes max(DoubleLanes x, DoubleLanes y) {
  return eachDouble([&](int i) { return at(y, i) < at(x, i) ? at(x, i) : at(y, i); });
}
inline DoubleLanes sqrt(DoubleLanes x) {
  return eachDouble([&](int i) { return __builtin_sqrt(at(x, i)); });
}
inline DoubleLanes absolute(DoubleLanes x) {
  return eachDouble([&](int i) { return __builtin_fabs(at(x, i)); });
}
// To the precision of float. g++ 12 leaves the way to float and back out where it makes vectors of it, unless
// it cannot know what is there.
inline DoubleLanes roundedToFloat(DoubleLanes x) {
  float floats[8];
  for (int i = 0; i < 8; ++i) floats[i] = static_cast<float>(at(x, i));
  asm("" : "+m"(floats));
  return eachDouble([&](int i) { return double{floats[i]}; });
}
// Bit i says whether it is so in lane i.
inline uint32_t bitsOfLess(DoubleLanes x, DoubleLanes y) {
  uint32_t bits = 0;
  for (int i = 0; i < 8; ++i) bits |= static_cast<uint32_t>(at(x, i) < at(y, i)) << i;
  return bits;
}

struct DoubleTriples {
  DoubleLanes x, y, z;
};
// Of eight triples of floats.
inline DoubleTriples loadTriples(const float* from) {
  const auto column = [&](int k) { return eachDouble([&](int i) { return double{from[3 * i + k]}; }); };
  return {column(0), column(1), column(2)};
}
inline void storeTriples(float* to, const DoubleTriples& t) {
  for (int i = 0; i < 8; ++i) {
    to[3 * i] = static_cast<float>(at(t.x, i));
    to[3 * i + 1] = static_cast<float>(at(t.y, i));
    to[3 * i + 2] = static_cast<float>(at(t.z, i));
  }
}

} // namespace
} // namespace surflect
