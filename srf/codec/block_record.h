// What the writer and the reader of a block's record share: docs/format.md specifies it to the byte.
#pragma once

#include "srf/codec/padded_rows.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::codec {

inline constexpr uint64_t allPresent = ~uint64_t{0};
inline constexpr uint8_t floatCoefficients = 1, partialBlock = 2; // flags
inline constexpr std::array precisions = {16, 8, 4};              // bits of a term, in the record's order

// Of terms at 16 bits; others have levels for coefficients as for eigenimages, of the same precision.
enum class CoefficientType { half, single };

// The quantiser is symmetric: -levels .. levels. Of 16 bits it has as many as  256 high + low,  both of 8.
constexpr int levelsOf(int bits) { return bits == 16 ? 257 * 127 : (1 << (bits - 1)) - 1; }

// Coefficients are in memory times 1 / M, the step of their image. Such is one of a term at 16 bits; and, for
// those below, what one level of coefficients makes whose last level is the peak.
inline float inImageSteps(float coefficient) {
  return static_cast<float>(coefficient / static_cast<double>(levelsOf(16)));
}
inline double levelInImageSteps(float peak, int bits) {
  return peak / static_cast<double>(levelsOf(bits) * levelsOf(bits));
}

constexpr size_t levelBytes(size_t values, int bits) { return (values * static_cast<size_t>(bits) + 7) / 8; }
constexpr size_t coefficientBytes(size_t lights, int bits, CoefficientType type) {
  if (bits == 16) return lights * (type == CoefficientType::half ? 2 : 4);
  return sizeof(float) + levelBytes(lights, bits);
}

// A term as a record has it.
struct StoredTerm {
  int bits = 0;
  std::vector<float> levels;       // [texels x channels]
  std::vector<float> coefficients; // [lights]; at 16 bits
  std::vector<float> lightLevels;  // [lights]; below 16 bits
  float peak = 0;                  // the coefficient of the last level; below 16 bits
};

struct StoredTerms {
  CoefficientType type = CoefficientType::half;
  std::vector<StoredTerm> terms; // bits falling
};

// Radiance that one level of an image adds under each light, as a reader has it: [terms][lights].
PaddedRows<double> shownPerLevel(const StoredTerms& stored, size_t lights);

std::vector<std::byte> recordOf(uint64_t present, size_t lights, const StoredTerms& stored);

} // namespace surflect::codec
