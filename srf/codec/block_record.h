// Layout of a block's record, shared by its writer and reader; docs/format.md specifies it to the byte.
#pragma once

#include "surfel/base/archive.h"
#include "surfel/math/padded_rows.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::codec {

inline constexpr uint64_t allPresent = ~uint64_t{0};
inline constexpr uint8_t floatCoefficients = 1, partialBlock = 2; // bits of the flags byte
inline constexpr std::array precisions = {16, 8, 4}; // bits of a term, in the order of the record

// Beginning of a record; its terms follow.
struct RecordHead {
  uint8_t flags = 0;
  std::array<uint8_t, precisions.size()> terms{}; // number at each precision
  uint64_t present = allPresent;                  // texel mask, as in encodeBlock; stored in a partialBlock
};
void describeRecordHead(Archive& archive, RecordHead& head);

// Type of the coefficients of 16-bit terms; coefficients of other terms are levels of the term's precision.
enum class CoefficientType { half, single };

// The last level of the symmetric quantiser -last .. last; at 16 bits the largest value of  256 high + low
// whose bytes are both in -127 .. 127.
constexpr int levelsOf(int bits) { return bits == 16 ? 257 * 127 : (1 << (bits - 1)) - 1; }

// Coefficients in memory are divided by the last level of their image, so that they multiply its levels
// directly. inImageSteps does so for a 16-bit coefficient; levelInImageSteps gives the value of one
// coefficient level of a term whose last coefficient level stands for `peak`.
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

// A term as stored in a record.
struct StoredTerm {
  int bits = 0;
  std::vector<float> levels;       // levels of the eigenimage, [texels x channels]
  std::vector<float> coefficients; // [lights]; at 16 bits
  std::vector<float> lightLevels;  // [lights]; below 16 bits
  float peak = 0;                  // the coefficient of the last light level; below 16 bits
};

struct StoredTerms {
  CoefficientType type = CoefficientType::half;
  std::vector<StoredTerm> terms; // by descending bits
};

// Radiance that one level of an eigenimage adds under each light, after decoding: [terms][lights].
PaddedRows<double> radiancePerLevel(const StoredTerms& stored, size_t lights);

std::vector<std::byte> recordOf(uint64_t present, size_t lights, const StoredTerms& stored);

} // namespace surflect::codec
