#include "srf/codec/block.h"

#include "srf/codec/block_record.h"
#include "surfel/base/error.h"
#include "surfel/base/memory.h"
#include "surfel/math/padded_rows.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

namespace surflect::codec {

namespace {

constexpr float coefficientLimit = 1e33f; // far above what radiances below 1e30 need; sums stay finite

// Sign-extends a two's complement nibble, 0 .. 15 to -8 .. 7.
constexpr int8_t signedNibble(int nibble) { return static_cast<int8_t>((nibble ^ 8) - 8); }

// Takes numbers from bytes that are known to be there.
class TermReader {
public:
  explicit TermReader(std::span<const std::byte> bytes) : from_(bytes.data()) {}

  const std::byte* take(size_t count) { return std::exchange(from_, from_ + count); }
  template <class T> T take() {
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }

private:
  const std::byte* from_;
};

// Reads levels of 8 or 4 bits. Clamps them to -levelsOf(bits), since two's complement holds one more below
// zero.
void takeLevels(TermReader& reader, int bits, size_t count, int8_t* levels) {
  const std::byte* const raw = reader.take(levelBytes(count, bits));
  const auto least = static_cast<int8_t>(-levelsOf(bits));
  if (bits == 8) {
    for (size_t i = 0; i < count; ++i) levels[i] = std::max(static_cast<int8_t>(raw[i]), least);
    return;
  }
  const auto levelOf = [=](int nibble) { return std::max(signedNibble(nibble), least); };
  for (size_t i = 0; i < count / 2; ++i) {
    levels[2 * i] = levelOf(std::to_integer<int>(raw[i] & std::byte{15}));
    levels[2 * i + 1] = levelOf(std::to_integer<int>(raw[i] >> 4));
  }
  if (count % 2 != 0) levels[count - 1] = levelOf(std::to_integer<int>(raw[count / 2] & std::byte{15}));
}

// Reads levels of 16 bits, each split as  256 high + low.
void takeWideLevels(TermReader& reader, size_t count, int8_t* high, int8_t* low) {
  const std::byte* const raw = reader.take(levelBytes(count, 16));
  const int last = levelsOf(16);
  for (size_t i = 0; i < count; ++i) {
    int16_t stored;
    std::memcpy(&stored, raw + 2 * i, sizeof stored);
    const int level = std::clamp<int>(stored, -last, last);
    low[i] = static_cast<int8_t>(level);
    high[i] = static_cast<int8_t>((level - low[i]) / 256);
  }
}

float takeCoefficient(TermReader& reader, CoefficientType type) {
  const float a =
      type == CoefficientType::half ? imath_half_to_float(reader.take<uint16_t>()) : reader.take<float>();
  if (!(std::abs(a) < coefficientLimit))
    throw Error::mismatch("a number below 1e33", numberText(a)).at("coefficients");
  return a;
}

// Decoded terms before they are transposed into a block, one per row; a term of 16 bits takes two rows.
struct TermRows {
  size_t lights, texelChannels;
  UninitializedVector<float> coefficients;      // times the step of one level
  UninitializedVector<int8_t> levels, ofLights; // ofLights: scratch, the light levels of one term

  TermRows(size_t rows, size_t lightCount, size_t channelCount)
      : lights(lightCount), texelChannels(channelCount), coefficients(rows * lights),
        levels(rows * texelChannels), ofLights(lights) {}
  float* coefficientsOf(size_t row) { return coefficients.data() + row * lights; }
  int8_t* imageOf(size_t row) { return levels.data() + row * texelChannels; }

  // Reads a term of 16 bits into `row` and the next row.
  void takeWide(TermReader& reader, CoefficientType type, size_t row) {
    float *high = coefficientsOf(row), *low = coefficientsOf(row + 1);
    for (size_t l = 0; l < lights; ++l) {
      low[l] = inImageSteps(takeCoefficient(reader, type));
      high[l] = 256 * low[l];
    }
    takeWideLevels(reader, texelChannels, imageOf(row), imageOf(row + 1));
  }
  // Reads a term of 8 or 4 bits into `row`.
  void take(TermReader& reader, int bits, size_t row) {
    const double ofLevel = levelInImageSteps(takeCoefficient(reader, CoefficientType::single), bits);
    takeLevels(reader, bits, lights, ofLights.data());
    float* const to = coefficientsOf(row);
    for (size_t l = 0; l < lights; ++l) to[l] = static_cast<float>(ofLevel * ofLights[l]);
    takeLevels(reader, bits, texelChannels, imageOf(row));
  }
  void clearFrom(size_t row) {
    std::fill(coefficients.begin() + static_cast<std::ptrdiff_t>(row * lights), coefficients.end(), 0.f);
    std::fill(levels.begin() + static_cast<std::ptrdiff_t>(row * texelChannels), levels.end(), int8_t{0});
  }
};

// nearestInRow[present][x]: the present texel of a row that is nearest to x, and the left one if two are
// equally near; blockSize if the row has none.
using NearestInRow = std::array<std::array<uint8_t, blockSize>, 1 << blockSize>;
constexpr NearestInRow nearestInRow = [] {
  NearestInRow nearest{};
  for (int set = 0; set < 1 << blockSize; ++set)
    for (int x = 0; x < blockSize; ++x) {
      const auto distance = [x](int other) { return other < x ? x - other : other - x; };
      int found = blockSize;
      for (int other = 0; other < blockSize; ++other)
        if ((set >> other & 1) != 0 && (found == blockSize || distance(other) < distance(found)))
          found = other;
      nearest[static_cast<size_t>(set)][static_cast<size_t>(x)] = static_cast<uint8_t>(found);
    }
  return nearest;
}();

// The present texel that is nearest to an absent texel; the first in row order if several are equally near.
int nearestPresent(uint64_t present, int texel) {
  const int x = texel % blockSize, y = texel / blockSize;
  int nearest = 0, least = 2 * blockTexels;
  for (int row = 0; row < blockSize; ++row) {
    const uint64_t set = present >> row * blockSize & ((1 << blockSize) - 1);
    const int other = nearestInRow[set][static_cast<size_t>(x)];
    const int squared = (other - x) * (other - x) + (row - y) * (row - y);
    if (other == blockSize || squared >= least) continue;
    least = squared;
    nearest = row * blockSize + other;
  }
  return nearest;
}

// Spreads the stored texels over the block; absent texels copy the nearest present one.
void spreadTexels(const int8_t* stored, uint64_t present, size_t texelLevels, int8_t* texels) {
  for (int t = 0; t < blockTexels; ++t) {
    const int source = present >> t & 1 ? t : nearestPresent(present, t);
    const int place = std::popcount(present & ((uint64_t{1} << source) - 1));
    std::copy_n(stored + place * texelLevels, texelLevels, texels + t * texelLevels);
  }
}

} // namespace

Block decodeBlock(std::span<const std::byte> record, size_t lights) {
  Archive archive(record);
  RecordHead head;
  describeRecordHead(archive, head);
  const auto& [flags, terms, present] = head;

  Block block;
  block.present = present;
  for (const int count : terms) block.rank += count;
  const size_t rows = 3 * std::popcount(block.present);
  if (const size_t limit = std::min(rows, lights); static_cast<size_t>(block.rank) > limit)
    throw Error::mismatch("at most " + std::to_string(limit), std::to_string(block.rank)).at("rank");
  block.stride = (block.rank + terms[0] + 7) / 8 * 8; // a term of 16 bits takes two

  const CoefficientType type = flags & floatCoefficients ? CoefficientType::single : CoefficientType::half;
  size_t bytes = 0;
  for (size_t p = 0; p < precisions.size(); ++p)
    bytes += terms[p] * (coefficientBytes(lights, precisions[p], type) + levelBytes(rows, precisions[p]));
  const std::span<const std::byte> rest = archive.rest();
  if (rest.size() != bytes)
    throw Error::mismatch(std::to_string(bytes) + " bytes of terms", std::to_string(rest.size()));
  block.lights = lights;
  if (block.rank == 0) return block;

  const auto stride = static_cast<size_t>(block.stride);
  TermReader reader(rest);
  TermRows termRows(stride, lights, rows);
  size_t row = 0;
  static_assert(precisions[0] == 16);
  for (int i = 0; i < terms[0]; ++i, row += 2) termRows.takeWide(reader, type, row);
  for (size_t p = 1; p < precisions.size(); ++p)
    for (int i = 0; i < terms[p]; ++i) termRows.take(reader, precisions[p], row++);
  termRows.clearFrom(row);

  block.values = CacheAlignedBytes(valuesBytes(block.stride, lights));
  auto* const coefficients = reinterpret_cast<float*>(block.values.data());
  auto* const levels = reinterpret_cast<int8_t*>(block.values.data() + levelsOffset(block.stride, lights));
  transpose(termRows.coefficients.data(), lights, stride, lights, coefficients, stride);
  if (block.present == allPresent) {
    transpose(termRows.levels.data(), rows, stride, rows, levels, stride);
    return block;
  }
  UninitializedVector<int8_t> ofPresent(rows * stride);
  transpose(termRows.levels.data(), rows, stride, rows, ofPresent.data(), stride);
  spreadTexels(ofPresent.data(), block.present, 3 * stride, levels);
  return block;
}

namespace {

// Relative error that 16 bits reach at full rank: half a quantiser step in each of up to 192 rows is
// sqrt(192) / (2 * 32639) = 2.1e-4.
constexpr double kReachable = 2.5e-4;
constexpr double kFaint = 1e-3; // part of white; darker blocks get the bound of this brightness

// r^2 + r + 0.01, the inverse square of errorWeight, with r = rms / white; T is a number or an array.
template <class T> T squaredError(const T& r) {
  constexpr double kDark = 0.01;
  return r * r + r + kDark;
}

} // namespace

double errorWeight(double rms, double white) { return 1 / std::sqrt(squaredError(rms / white)); }

BlockWeights blockWeights(const ChannelEnergies& squares, double white) {
  using PerChannel = Eigen::Array3Xd;
  using PerLight = Eigen::Array<double, 1, Eigen::Dynamic>;
  const PerChannel means = squares.sums.array() / static_cast<double>(squares.texels);
  const auto ofChannels = squaredError<PerChannel>(means.sqrt() / white);
  const auto ofLights = squaredError<PerLight>(means.colwise().mean().sqrt() / white);
  const PerChannel ratios = ofChannels.inverse().rowwise() * ofLights;
  return {ratios.rowwise().mean().sqrt().matrix(), ofLights.sqrt().inverse().matrix().transpose()};
}

double weightedSquares(const ChannelEnergies& squares, const BlockWeights& weights) {
  return weights.channels.cwiseAbs2().dot(squares.sums * weights.lights.cwiseAbs2());
}

double blockErrorBound(const ChannelEnergies& squares, const BlockWeights& weights, double tolerance,
                       double white) {
  const auto values = static_cast<double>(3 * squares.texels * squares.sums.cols());
  const double floor = kFaint * white * errorWeight(kFaint * white, white) * std::sqrt(values);
  const BlockWeights alike{Eigen::Vector3d::Constant(weights.channels.maxCoeff()), weights.lights};
  return std::max(tolerance * std::max(std::sqrt(weightedSquares(squares, weights)), floor),
                  kReachable * std::sqrt(weightedSquares(squares, alike)));
}

double channelMeanBound(double mean, double white) {
  constexpr double kOfMean = 2e-3;
  return kOfMean * std::max(std::abs(mean), kFaint * white);
}

} // namespace surflect::codec
