#include "srf/store/block.h"

#include "srf/store/block_record.h"
#include "srf/store/bytes.h"
#include "surfel/error.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace surflect {

namespace {

constexpr float coefficientLimit = 1e33f; // far above what radiances below 1e30 need; sums stay finite

// Of two's complement.
constexpr int signedNibble(int nibble) { return (nibble ^ 8) - 8; }

// use(i, level), for each.
template <class Use> void takeLevels(ByteReader& reader, int bits, size_t count, const Use& use) {
  const std::byte* const raw = reader.take(levelBytes(count, bits)).data();
  const int last = levelsOf(bits);
  const auto each = [&](const auto& levelAt) {
    for (size_t i = 0; i < count; ++i) use(i, std::clamp<int>(levelAt(i), -last, last));
  };
  if (bits == 16)
    each([raw](size_t i) {
      int16_t level;
      std::memcpy(&level, raw + 2 * i, sizeof level);
      return level;
    });
  else if (bits == 8)
    each([raw](size_t i) { return static_cast<int8_t>(raw[i]); });
  else
    each([raw](size_t i) { return signedNibble(std::to_integer<int>(raw[i / 2]) >> (i % 2 * 4) & 15); });
}

// Of 8 bits, as levels are in memory.
int planesOf(int bits) { return bits == 16 ? 2 : 1; }

// Written to e[0], e[stride], ...; of 16 bits, high ones to e[0], low ones to e[1].
void takeImage(ByteReader& reader, int bits, size_t count, int8_t* e, size_t stride) {
  if (bits == 16)
    takeLevels(reader, bits, count, [=](size_t i, int level) {
      const auto low = static_cast<int8_t>(level);
      e[i * stride] = static_cast<int8_t>((level - low) / 256);
      e[i * stride + 1] = low;
    });
  else
    takeLevels(reader, bits, count, [=](size_t i, int level) { e[i * stride] = static_cast<int8_t>(level); });
}

float takeCoefficient(ByteReader& reader, CoefficientType type) {
  const float a =
      type == CoefficientType::half ? imath_half_to_float(reader.take<uint16_t>()) : reader.take<float>();
  if (!(std::abs(a) < coefficientLimit))
    throw Error::mismatch("a number below 1e33", numberText(a)).at("coefficients");
  return a;
}

// Of the planes that takeImage makes, times what a level stands for.
void takeCoefficients(ByteReader& reader, int bits, CoefficientType type, size_t lights, float* a,
                      size_t stride) {
  if (bits == 16) {
    for (size_t l = 0; l < lights; ++l) {
      const float low = inImageSteps(takeCoefficient(reader, type));
      a[l * stride] = 256 * low;
      a[l * stride + 1] = low;
    }
    return;
  }
  const double ofLevel = levelInImageSteps(takeCoefficient(reader, CoefficientType::single), bits);
  takeLevels(reader, bits, lights,
             [=](size_t l, int level) { a[l * stride] = static_cast<float>(ofLevel * level); });
}

// The present texel nearest to an absent one, the first of those equally near.
int nearestPresent(uint64_t present, int texel) {
  int nearest = 0, least = 2 * blockTexels;
  for (uint64_t rest = present; rest != 0; rest &= rest - 1) {
    const int other = std::countr_zero(rest);
    const int dx = other % blockSize - texel % blockSize, dy = other / blockSize - texel / blockSize;
    if (dx * dx + dy * dy >= least) continue;
    least = dx * dx + dy * dy;
    nearest = other;
  }
  return nearest;
}

} // namespace

Block decodeBlock(std::span<const std::byte> record, size_t lights) {
  ByteReader reader(record);
  const auto flags = reader.take<uint8_t>();
  if ((flags & ~(floatCoefficients | partialBlock)) != 0)
    throw Error::mismatch("0..3", std::to_string(flags)).at("flags");
  std::array<int, precisions.size()> terms{}; // at each precision
  for (int& count : terms) count = reader.take<uint8_t>();

  Block block;
  block.present = flags & partialBlock ? reader.take<uint64_t>() : allPresent;
  if (block.present == 0) throw Error::mismatch("at least one texel", "none").at("present");
  for (const int count : terms) block.rank += count;
  const size_t rows = 3 * std::popcount(block.present);
  if (const size_t limit = std::min(rows, lights); static_cast<size_t>(block.rank) > limit)
    throw Error::mismatch("at most " + std::to_string(limit), std::to_string(block.rank)).at("rank");
  for (size_t p = 0; p < precisions.size(); ++p) block.stride += terms[p] * planesOf(precisions[p]);
  block.stride = (block.stride + 7) / 8 * 8;

  const CoefficientType type = flags & floatCoefficients ? CoefficientType::single : CoefficientType::half;
  size_t bytes = 0;
  for (size_t p = 0; p < precisions.size(); ++p)
    bytes += terms[p] * (coefficientBytes(lights, precisions[p], type) + levelBytes(rows, precisions[p]));
  if (reader.left() != bytes)
    throw Error::mismatch(std::to_string(bytes) + " bytes of terms", std::to_string(reader.left()));
  block.lights = lights;
  const size_t texelLevels = 3 * static_cast<size_t>(block.stride);
  block.values.resize((valuesBytes(block.stride, lights) + sizeof(CacheLine) - 1) / sizeof(CacheLine));
  auto* const values = reinterpret_cast<std::byte*>(block.values.data());
  auto* const coefficients = reinterpret_cast<float*>(values);
  auto* const levels = reinterpret_cast<int8_t*>(values + levelsOffset(block.stride, lights));
  std::vector<int8_t> ofPresent; // texels as they are stored, where some are absent
  if (block.present != allPresent) ofPresent.resize(rows * block.stride);
  int8_t* const stored = ofPresent.empty() ? levels : ofPresent.data();
  int k = 0;
  for (size_t p = 0; p < precisions.size(); ++p)
    for (int i = 0; i < terms[p]; ++i, k += planesOf(precisions[p])) {
      takeCoefficients(reader, precisions[p], type, lights, coefficients + k, block.stride);
      takeImage(reader, precisions[p], rows, stored + k, block.stride);
    }
  if (ofPresent.empty()) return block;
  for (int t = 0; t < blockTexels; ++t) {
    const int source = block.present >> t & 1 ? t : nearestPresent(block.present, t);
    const int place = std::popcount(block.present & ((uint64_t{1} << source) - 1));
    std::copy_n(stored + place * texelLevels, texelLevels, levels + t * texelLevels);
  }
  return block;
}

} // namespace surflect
