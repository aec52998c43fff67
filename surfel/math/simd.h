// Which vector instructions kernels use: the best that the processor has, unless the process chooses others.
// Kernels are written once over Highway, which compiles and calls them for each instruction set.
#pragma once

#include <array>
#include <string_view>
#include <vector>

namespace surflect {

enum class Simd { scalar, avx2, avx512 }; // each includes those before

constexpr std::array<std::string_view, 3> simdNames{"scalar", "avx2", "avx512"};
constexpr std::string_view nameOf(Simd simd) { return simdNames[static_cast<size_t>(simd)]; }

// Instruction sets that this processor has, the slowest first.
const std::vector<Simd>& supportedSimd();

// The instruction set that kernels use.
Simd bestSimd();
// Chooses the instruction set of the whole process. Must not be called while kernels run.
void useSimd(Simd simd);

} // namespace surflect
