#include "srf/model/level_file.h"

#include "tests/srf/image/files.h"
#include "tests/support/damage.h"

#include <cstring>
#include <limits>

namespace surflect::model {
namespace {

// A cloud of five surfels with three levels: surfels 0..4, then 1, 3 and 4, then 3.
struct Five {
  SurfelCloud cloud;
  LevelsOfDetail levels{3, {0}, {}};
  std::vector<std::byte> packed;

  Five() {
    const size_t counts[] = {1, 2, 1, 3, 2};
    for (size_t i = 0; i < 5; ++i) {
      for (size_t level = 0; level < counts[i]; ++level)
        levels.splats.push_back({static_cast<float>(1 + i + level), 0.25f * static_cast<float>(level)});
      levels.first.push_back(static_cast<uint32_t>(levels.splats.size()));
      cloud.p0.emplace_back(static_cast<float>(i), 0.f, 0.f);
      cloud.radius.push_back(levels.of(i)[0].radius);
      cloud.coverage.push_back(levels.of(i)[0].coverage);
    }
    cloud.r0.resize(5);
    packed = packLevels(levels);
  }
  // One line that says why the file is rejected, with a number of `bytes` bytes replaced.
  template <class Number> std::string errorWith(size_t at, Number number) const {
    std::vector<std::byte> damaged = packed;
    std::memcpy(damaged.data() + at, &number, sizeof number);
    return image::errorOf([&] { unpackLevels(damaged, cloud); });
  }
};

constexpr size_t kLast = 20, kSplats = kLast + 5; // first bytes

TEST(LevelFile, WhatIsPackedIsUnpackedEqual) {
  const Five five;
  EXPECT_EQ(unpackLevels(five.packed, five.cloud), five.levels);
  EXPECT_EQ(five.packed.size(), kSplats + 4 * 8);
  const LevelsOfDetail nothing{1, {0}, {}};
  EXPECT_EQ(unpackLevels(packLevels(nothing), {}), nothing);
}

TEST(LevelFile, DamageIsRefusedOrStillNestedLevels) {
  const Five five;
  tryDamage(five.packed, [&](std::span<const std::byte> damaged) {
    const LevelsOfDetail levels = unpackLevels(damaged, five.cloud);
    ASSERT_EQ(levels.first.size(), 6u);
    ASSERT_EQ(levels.first.back(), levels.splats.size());
    for (const DetailSplat& splat : levels.splats) EXPECT_TRUE(splat.radius >= 0 && splat.coverage >= 0);
  });
}

TEST(LevelFile, AWildValueIsNamed) {
  const Five five;
  EXPECT_EQ(five.errorWith(0, 'x'), "magic: found other bytes, expected \"srf lods\"");
  EXPECT_EQ(five.errorWith(8, 2u), "version: found 2, expected 1");
  EXPECT_EQ(five.errorWith(12, 0u), "levels: found 0, expected 1..10");
  EXPECT_EQ(five.errorWith(12, 11u), "levels: found 11, expected 1..10");
  EXPECT_EQ(five.errorWith(16, 6u), "surfels: found 6, expected 5");
  EXPECT_EQ(five.errorWith(kLast + 4, uint8_t{3}), "last[4]: found 3, expected 0..2");
  EXPECT_EQ(five.errorWith(kLast + 4, uint8_t{255}), "last[4]: found 255, expected 0..2");
  EXPECT_EQ(five.errorWith(kSplats, -1.f), "splats[0]: found -1, expected a finite number of at least 0");
  EXPECT_EQ(five.errorWith(kSplats + 8 + 12, std::numeric_limits<float>::infinity()),
            "splats[2]: found inf, expected a finite number of at least 0");
  EXPECT_EQ(five.errorWith(kSplats + 24, std::numeric_limits<float>::quiet_NaN()),
            "splats[3]: found nan, expected a finite number of at least 0");
}

TEST(LevelFile, ALevelThatDropsNoSurfelIsRefused) {
  const Five five;
  EXPECT_EQ(five.errorWith(12, 4u), "level[3]: found as many, expected fewer surfels in the next");
  std::vector<std::byte> damaged = five.packed;
  damaged[kLast + 1] = std::byte{2}; // levels 1 and 2 as surfels 1 and 3
  damaged[kLast + 4] = std::byte{0};
  EXPECT_EQ(image::errorOf([&] { unpackLevels(damaged, five.cloud); }),
            "level[1]: found as many, expected fewer surfels in the next");
}

} // namespace
} // namespace surflect::model
