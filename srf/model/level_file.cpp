#include "srf/model/level_file.h"

#include "surfel/base/endian.h"
#include "surfel/base/error.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>

namespace surflect::model {

namespace {

constexpr std::string_view kMagic = "srf lods";
constexpr uint32_t kVersion = 1;
constexpr size_t kHeader = 20; // bytes: magic, version, levels, surfels

static_assert(std::endian::native == std::endian::little && sizeof(DetailSplat) == 2 * sizeof(float));

void append(std::vector<std::byte>& bytes, const void* from, size_t count) {
  const auto* first = static_cast<const std::byte*>(from);
  bytes.insert(bytes.end(), first, first + count);
}

Error mismatch(const std::string& expected, size_t found, const std::string& field) {
  return Error::mismatch(expected, std::to_string(found)).at(field);
}

Error wrongSize(const std::string& expected, size_t found) {
  return Error::mismatch(expected + " bytes", std::to_string(found) + " bytes").at("size");
}

std::string nameOf(size_t surfel) { return "surfel[" + std::to_string(surfel) + "]"; }

// Number of levels, from a header that fits the cloud.
size_t parseHeader(std::string_view packed, size_t surfels) {
  if (packed.size() < kHeader) throw wrongSize("at least " + std::to_string(kHeader), packed.size());
  if (!packed.starts_with(kMagic)) throw Error::mismatch("'srf lods'", "other bytes").at("magic");
  const uint32_t version = littleEndian(packed, 8), levels = littleEndian(packed, 12),
                 stated = littleEndian(packed, 16);
  if (version != kVersion) throw mismatch(std::to_string(kVersion), version, "version");
  if (levels < 1 || levels > kMostLevels)
    throw mismatch("1 to " + std::to_string(kMostLevels), levels, "levels");
  if (stated != surfels) throw mismatch(std::to_string(surfels), stated, "surfels");
  if (packed.size() - kHeader < surfels)
    throw wrongSize("at least " + std::to_string(kHeader + surfels), packed.size());
  return levels;
}

// Throws Error unless each level is the last one of a surfel, so that each level has fewer surfels than the
// one before.
void requireNested(std::span<const size_t> surfelsUpTo, size_t levels) {
  for (size_t level = 0; level < levels; ++level)
    if (surfelsUpTo[level] == 0)
      throw Error::mismatch("fewer surfels in the next", "as many")
          .at("level[" + std::to_string(level) + "]");
}

void requireNumber(float value, const char* name, size_t level, size_t surfel) {
  if (!(std::isfinite(value) && value >= 0))
    throw Error::mismatch("a finite number of at least 0", numberText(value))
        .at(name)
        .at("splat[" + std::to_string(level) + "]")
        .at(nameOf(surfel));
}

} // namespace

std::vector<std::byte> packLevels(const LevelsOfDetail& levels) {
  const size_t surfels = levels.first.size() - 1;
  std::vector<std::byte> bytes;
  bytes.reserve(kHeader + surfels + (levels.splats.size() - surfels) * sizeof(DetailSplat));
  append(bytes, kMagic.data(), kMagic.size());
  for (const size_t number : {size_t{kVersion}, levels.count, surfels}) {
    const auto narrow = static_cast<uint32_t>(number);
    append(bytes, &narrow, sizeof narrow);
  }
  for (size_t i = 0; i < surfels; ++i) bytes.push_back(static_cast<std::byte>(levels.of(i).size() - 1));
  for (size_t i = 0; i < surfels; ++i) {
    const auto further = levels.of(i).subspan(1);
    append(bytes, further.data(), further.size_bytes());
  }
  return bytes;
}

LevelsOfDetail unpackLevels(std::string_view packed, const SurfelCloud& cloud, const Progress& progress) {
  const size_t surfels = cloud.size();
  LevelsOfDetail result{.count = parseHeader(packed, surfels), .first = {}, .splats = {}};
  result.first.reserve(surfels + 1);
  result.first.push_back(0);
  std::array<size_t, kMostLevels> surfelsUpTo{};
  size_t splats = 0;
  for (size_t i = 0; i < surfels; ++i) {
    progress.checkNowAndThen(i);
    const auto last = static_cast<uint8_t>(packed[kHeader + i]);
    if (last >= result.count)
      throw mismatch("at most " + std::to_string(result.count - 1), last, "last").at(nameOf(i));
    ++surfelsUpTo[last];
    splats += last + 1u;
    result.first.push_back(static_cast<uint32_t>(splats));
  }
  if (surfels > 0 || result.count > 1) requireNested(surfelsUpTo, result.count);
  const size_t size = kHeader + surfels + (splats - surfels) * sizeof(DetailSplat);
  if (packed.size() != size) throw wrongSize(std::to_string(size), packed.size());
  if (splats > std::numeric_limits<uint32_t>::max()) throw mismatch("fewer than 2^32", splats, "splats");

  result.splats.resize(splats);
  const char* from = packed.data() + kHeader + surfels;
  for (size_t i = 0; i < surfels; ++i) {
    progress.checkNowAndThen(i);
    DetailSplat* const own = result.splats.data() + result.first[i];
    const size_t further = result.of(i).size() - 1;
    own[0] = {cloud.radius[i], cloud.coverage[i]};
    std::memcpy(own + 1, from, further * sizeof(DetailSplat));
    from += further * sizeof(DetailSplat);
    for (size_t level = 1; level <= further; ++level) {
      requireNumber(own[level].radius, "radius", level, i);
      requireNumber(own[level].coverage, "coverage", level, i);
    }
  }
  return result;
}

} // namespace surflect::model
