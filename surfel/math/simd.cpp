#include "surfel/math/simd.h"

#include <hwy/targets.h>

namespace surflect {

namespace {

Simd& chosen() {
  static Simd simd = supportedSimd().back();
  return simd;
}

} // namespace

const std::vector<Simd>& supportedSimd() {
  static const std::vector<Simd> supported = [] {
    const int64_t targets = hwy::SupportedTargets();
    std::vector<Simd> all{Simd::scalar};
    if (targets & HWY_AVX2) all.push_back(Simd::avx2);
    if (targets & HWY_AVX3) all.push_back(Simd::avx512);
    return all;
  }();
  return supported;
}

Simd bestSimd() { return chosen(); }

void useSimd(Simd simd) {
  chosen() = simd;
  constexpr int64_t avx512 = HWY_AVX3 | HWY_AVX3_DL;
  hwy::DisableTargets(simd == Simd::avx512 ? 0 : simd == Simd::avx2 ? avx512 : avx512 | HWY_AVX2);
}

} // namespace surflect
