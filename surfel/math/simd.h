// Which vector instructions a kernel uses. The caller chooses once and passes the choice along in its
// options.
//
// Kernels are written once in x_kernel_loops.h and compiled by x_kernels_scalar.cpp, x_kernels_avx2.cpp and
// x_kernels_avx512.cpp, as far as each pays, the last two with the options that surflect_simd_source
// (cmake/SurflectTargets.cmake) gives them. Code compiled so
// has internal linkage and calls no inline function of a library: the linker may keep any copy of that for
// everyone.
#pragma once

#include <array>
#include <string_view>
#include <vector>

namespace surflect {

enum class Simd { scalar, avx2, avx512 }; // each includes those before

constexpr std::array<std::string_view, 3> simdNames{"scalar", "avx2", "avx512"};
constexpr std::string_view nameOf(Simd simd) { return simdNames[static_cast<size_t>(simd)]; }

// The best that this processor has. avx2: and FMA; avx512: F, BW, DQ and VL.
inline Simd bestSimd() {
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (avx2 && avx512) return Simd::avx512;
  if (avx2) return Simd::avx2;
#endif
  return Simd::scalar;
}

// All that this processor has, the slowest first.
inline std::vector<Simd> supportedSimd() {
  std::vector<Simd> all;
  for (const Simd simd : {Simd::scalar, Simd::avx2, Simd::avx512})
    if (simd <= bestSimd()) all.push_back(simd);
  return all;
}

} // namespace surflect
