#include "bench/doll/doll_blocks.h"

#include "bench/doll/spiral.h"
#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"
#include "srf/codec/bytes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <random>

namespace surflect::bench {

namespace {

constexpr size_t kNormals = 128, kVariants = 4;
constexpr std::array kPrecisions = {16, 8, 4}; // bits, in the order of a record; see docs/format.md
constexpr uint8_t kFloats = 1, kPartial = 2;   // flags of a record

size_t levelBytes(size_t values, int bits) { return (values * static_cast<size_t>(bits) + 7) / 8; }

size_t coefficientBytes(size_t lights, int bits, uint8_t flags) {
  if (bits == 16) return lights * (flags & kFloats ? sizeof(float) : 2);
  return sizeof(float) + levelBytes(lights, bits);
}

// One channel of cloth: rough, woven, with a glossy lobe about the normal; what lights behind leave is
// scattered light.
double reflected(double cosine, double albedo, double gloss) {
  if (cosine <= 0) return 0.01 * albedo;
  return albedo * cosine + gloss * std::pow(cosine, 60);
}

} // namespace

Eigen::MatrixXf dollPatch(const Vec3<double>& normal, std::span<const capture::Light> lights, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform;
  const Vec3<double> albedo(0.2 + 0.6 * uniform(random), 0.2 + 0.6 * uniform(random),
                            0.2 + 0.6 * uniform(random));
  const Vec3<double> print(uniform(random), uniform(random), uniform(random));
  const double gloss = 0.6 * uniform(random), phase = 6.28 * uniform(random), pitch = 0.5 + uniform(random);
  const Vec3<double> right = normal.unitOrthogonal(), up = normal.cross(right);
  constexpr double kTurn = 0.006, kBump = 0.03; // radians a pixel, and of the weave
  constexpr double kNoise = 0.01;               // of white, of what is as bright; of photons
  Eigen::MatrixXf radiance(3 * codec::blockTexels, lights.size());
  for (int texel = 0; texel < codec::blockTexels; ++texel) {
    const double x = texel % codec::blockSize - 3.5, y = texel / codec::blockSize - 3.5;
    const Vec3<double> bump(gauss(random), gauss(random), gauss(random));
    const Vec3<double> n = (normal + kTurn * (x * right + y * up) + kBump * bump).normalized();
    const double stripe = 0.5 + 0.5 * std::sin(pitch * (x + 0.4 * y) + phase);
    for (size_t light = 0; light < lights.size(); ++light) {
      const auto towards = std::get<capture::DirectionalLight>(lights[light].kind).towards.raw();
      for (int channel = 0; channel < 3; ++channel) {
        const double colour = albedo[channel] * (1 - 0.5 * stripe) + 0.5 * stripe * print[channel];
        const double value = reflected(n.dot(towards), colour, gloss);
        radiance(3 * texel + channel, static_cast<Eigen::Index>(light)) =
            static_cast<float>(value + kNoise * std::sqrt(value) * gauss(random));
      }
    }
  }
  return radiance;
}

std::vector<std::byte> withTexels(std::span<const std::byte> record, size_t lights, uint64_t present) {
  assert(present != 0);
  if (present == ~uint64_t{0}) return {record.begin(), record.end()};
  codec::ByteReader reader(record);
  const auto flags = reader.take<uint8_t>();
  assert((flags & kPartial) == 0);
  std::array<size_t, kPrecisions.size()> terms{}, kept{};
  for (size_t& count : terms) count = reader.take<uint8_t>();
  const size_t rank = terms[0] + terms[1] + terms[2];
  const size_t rows = 3 * static_cast<size_t>(std::popcount(present));
  size_t rest = std::min(rank, rows);
  for (size_t p = 0; p < terms.size(); ++p) rest -= kept[p] = std::min(terms[p], rest);

  std::vector<std::byte> part;
  part.reserve(record.size() + sizeof present);
  codec::append(part, static_cast<uint8_t>(flags | kPartial));
  for (const size_t count : kept) codec::append(part, static_cast<uint8_t>(count));
  codec::append(part, present);
  const auto add = [&](std::span<const std::byte> bytes) {
    part.insert(part.end(), bytes.begin(), bytes.end());
  };
  for (size_t p = 0; p < terms.size(); ++p)
    for (size_t term = 0; term < terms[p]; ++term) {
      const int bits = kPrecisions[p];
      const auto coefficients = reader.take(coefficientBytes(lights, bits, flags));
      const auto image = reader.take(levelBytes(3 * codec::blockTexels, bits));
      if (term >= kept[p]) continue;
      add(coefficients);
      std::vector<std::byte> left(levelBytes(rows, bits));
      size_t row = 0; // of those left
      for (size_t from = 0; from < 3 * codec::blockTexels; ++from) {
        if (!(present >> from / 3 & 1)) continue;
        if (bits == 4) {
          const std::byte level = (image[from / 2] >> (from % 2 * 4)) & std::byte{15};
          left[row / 2] |= level << (row % 2 * 4);
        } else {
          const size_t size = static_cast<size_t>(bits) / 8;
          std::copy_n(image.begin() + static_cast<std::ptrdiff_t>(from * size), size,
                      left.begin() + static_cast<std::ptrdiff_t>(row * size));
        }
        ++row;
      }
      add(left);
    }
  return part;
}

DollBlocks::DollBlocks(std::span<const capture::Light> lights, uint64_t seed)
    : lights_(lights.size()), normals_(spiral(kNormals)), records_(kNormals * kVariants) {
  tbb::parallel_for(size_t{0}, records_.size(), [&](size_t i) {
    const auto radiance = dollPatch(normals_[i / kVariants], lights, seed * records_.size() + i);
    records_[i] = codec::encodeBlock(~uint64_t{0}, radiance, kTolerance, kWhite).record;
  });
}

std::vector<std::byte> DollBlocks::record(const Vec3<double>& normal, uint64_t variant,
                                          uint64_t present) const {
  const auto nearest = std::ranges::max_element(normals_, {}, [&](const auto& n) { return n.dot(normal); });
  const auto index = static_cast<size_t>(nearest - normals_.begin()) * kVariants + variant % kVariants;
  return withTexels(records_[index], lights_, present);
}

} // namespace surflect::bench
