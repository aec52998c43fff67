// Random numbers that depend on nothing but what they are for, so that pictures have the same bits whatever
// thread makes which pixel.
//
// [Steele 2014] Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA.
#pragma once

#include <cstdint>
#include <initializer_list>

namespace surflect {

// SplitMix64.  [Steele 2014]
class Random {
public:
  // A stream of its own for each list of keys.
  explicit Random(std::initializer_list<uint64_t> keys) {
    for (const uint64_t key : keys) state_ = mixed(state_ + kStep) ^ mixed(key + kStep);
  }

  // In [0, 1).
  double next() { return static_cast<double>(mixed(state_ += kStep) >> 11) * 0x1p-53; }

private:
  static constexpr uint64_t kStep = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio

  static uint64_t mixed(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }

  uint64_t state_ = 0;
};

} // namespace surflect
