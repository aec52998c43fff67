// Tests of kernels in each instruction set.
#pragma once

#include "surfel/math/simd.h"

namespace surflect {

// for (const Simd simd : EachSimd()): runs the body in each instruction set that this processor has.
struct EachSimd {
  struct Iterator {
    std::vector<Simd>::const_iterator at;
    Simd operator*() const {
      useSimd(*at);
      return *at;
    }
    Iterator& operator++() {
      ++at;
      return *this;
    }
    bool operator==(const Iterator&) const = default;
  };
  Iterator begin() const { return {supportedSimd().begin()}; }
  Iterator end() const { return {supportedSimd().end()}; }

  ~EachSimd() { useSimd(supportedSimd().back()); }
};

// Returns run()'s result in one instruction set.
template <class Run> auto inSimd(Simd simd, const Run& run) {
  const Simd before = bestSimd();
  useSimd(simd);
  auto result = run();
  useSimd(before);
  return result;
}

} // namespace surflect
