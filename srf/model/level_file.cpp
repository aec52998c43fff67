#include "srf/model/level_file.h"

#include "surfel/base/archive.h"
#include "surfel/base/error.h"

#include <array>
#include <limits>
#include <string>

namespace surflect::model {

namespace {

// Levels as they are stored. Splats of level 0 are those of the cloud.
struct StoredLevels {
  size_t count = 0;
  std::vector<uint8_t> last;        // of each surfel, the last level that contains it
  std::vector<DetailSplat> further; // of levels 1..last, surfel by surfel
};

void describeLevels(Archive& archive, StoredLevels& levels, size_t surfels) {
  archive.magic("srf lods");
  archive.constant<uint32_t>("version", 1);
  archive.number<uint32_t>("levels", levels.count, {1, kMostLevels});
  archive.constant<uint32_t>("surfels", static_cast<uint32_t>(surfels));
  archive.array<uint8_t>("last", levels.last, surfels, Below(levels.count));
  size_t further = 0;
  for (const uint8_t last : levels.last) further += last;
  archive.array<float>("splats", levels.further, further, {0});
}

// Throws Error unless each level is the last one of a surfel, so that each level has fewer surfels than the
// one before.
void requireNested(const StoredLevels& levels) {
  std::array<size_t, kMostLevels> surfelsUpTo{};
  for (const uint8_t last : levels.last) ++surfelsUpTo[last];
  for (size_t level = 0; level < levels.count; ++level)
    if (surfelsUpTo[level] == 0 && (levels.count > 1 || !levels.last.empty()))
      throw Error::mismatch("fewer surfels in the next", "as many")
          .at("level[" + std::to_string(level) + "]");
}

} // namespace

std::vector<std::byte> packLevels(const LevelsOfDetail& levels) {
  StoredLevels stored{levels.count, {}, {}};
  for (size_t i = 0; i + 1 < levels.first.size(); ++i) {
    const auto splats = levels.of(i);
    stored.last.push_back(static_cast<uint8_t>(splats.size() - 1));
    stored.further.insert(stored.further.end(), splats.begin() + 1, splats.end());
  }
  return written(stored,
                 [](Archive& archive, StoredLevels& own) { describeLevels(archive, own, own.last.size()); });
}

LevelsOfDetail unpackLevels(std::span<const std::byte> packed, const SurfelCloud& cloud,
                            const Progress& progress) {
  StoredLevels stored;
  parse(packed, [&](Archive& archive) { describeLevels(archive, stored, cloud.size()); });
  requireNested(stored);
  if (stored.further.size() + cloud.size() > std::numeric_limits<uint32_t>::max())
    throw Error::mismatch("fewer than 2^32", std::to_string(stored.further.size() + cloud.size()))
        .at("splats");
  LevelsOfDetail levels{.count = stored.count, .first = {0}, .splats = {}};
  levels.first.reserve(cloud.size() + 1);
  levels.splats.reserve(stored.further.size() + cloud.size());
  auto further = stored.further.begin();
  for (size_t i = 0; i < cloud.size(); ++i) {
    progress.checkNowAndThen(i);
    levels.splats.push_back({cloud.radius[i], cloud.coverage[i]});
    levels.splats.insert(levels.splats.end(), further, further + stored.last[i]);
    further += stored.last[i];
    levels.first.push_back(static_cast<uint32_t>(levels.splats.size()));
  }
  return levels;
}

} // namespace surflect::model
