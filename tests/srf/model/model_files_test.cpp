#include "srf/model/model_files.h"

#include "srf/image/deflate.h"
#include "srf/reflectance/shared_reflectance.h"
#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/support/damage.h"
#include "tests/support/patience.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

namespace surflect::model {

namespace {

codec::AlphaPlane randomPlane() { return codec::AlphaPlane(image::randomImage(37, 21, 1, 0, 1, 7)); }

TEST(AlphaFile, WhatIsPackedIsUnpackedEqual) {
  const codec::AlphaPlane plane = randomPlane();
  const codec::AlphaPlane unpacked = unpackAlpha(packAlpha(plane), 37, 21);
  EXPECT_EQ(unpacked.width(), 37);
  EXPECT_EQ(unpacked.height(), 21);
  EXPECT_EQ(unpacked.levels(), plane.levels());
}

TEST(AlphaFile, DamageIsRefusedOrChangesNothing) {
  const codec::AlphaPlane plane = randomPlane();
  tryDamage(packAlpha(plane), [&](std::span<const std::byte> damaged) {
    EXPECT_EQ(unpackAlpha(damaged, 37, 21).levels(), plane.levels());
  });
}

TEST(AlphaFile, ErrorsNameTheFieldWhatWasFoundAndExpected) {
  const std::vector<std::byte> packed = packAlpha(randomPlane());
  const auto complaintOf = [&](size_t at, std::byte byte) {
    std::vector<std::byte> changed = packed;
    changed[at] = byte;
    return image::errorOf([&] { unpackAlpha(changed, 37, 21); });
  };
  EXPECT_EQ(complaintOf(0, std::byte{'x'}), "magic: found other bytes, expected \"srf alph\"");
  EXPECT_EQ(complaintOf(8, std::byte{2}), "version: found 2, expected 1");
  EXPECT_EQ(complaintOf(12, std::byte{38}), "width: found 38, expected 37");
  EXPECT_EQ(image::errorOf([&] { unpackAlpha(packed, 21, 37); }), "width: found 37, expected 21");
  EXPECT_EQ(complaintOf(packed.size() - 1, ~packed.back()),
            "levels: found other content, expected a zlib stream of 777 bytes");
}

} // namespace

namespace {

constexpr uint32_t kTableSurfels = 40;

reflectance::SharedReflectance randomTables() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(0, 1);
  reflectance::SharedReflectance shared{0.25f, {{{5, 5, 3, 3}}, {}}, {1, 0.25f, 0}, {}, {}, {}, {}};
  for (int table = 0; table < 3; ++table) {
    std::vector<Rgb> nodes;
    for (size_t node = 0; node < shared.tables.grid.size(); ++node) nodes.push_back({any(random), 2, -0.5f});
    shared.tables.add(nodes);
  }
  for (uint32_t i = 0; i < kTableSurfels; ++i) {
    shared.tilts.push_back({0.2f * any(random) - 0.1f, 0.25f});
    shared.fibres.push_back(Angle::fromRadians(any(random) * std::numbers::pi));
    const float second = 0.4f * any(random), third = 0.2f * any(random);
    shared.mixtures.push_back({{2, 0, 1}, {1 - second - third, second, third}});
    shared.gains.push_back({any(random), 1, 20});
  }
  return shared;
}

// A table file in version 1.
std::vector<std::byte> uncompressed(std::vector<std::byte> packed) {
  constexpr size_t kHeader = 52; // with the trust in three tables
  std::vector<std::byte> arrays(6 * 3 * reflectance::TableGrid{{5, 5, 3, 3}}.size() + 18 * kTableSurfels);
  EXPECT_TRUE(image::inflatesTo(std::span(packed).subspan(kHeader), arrays));
  packed.resize(kHeader);
  packed[8] = std::byte{1};
  packed.insert(packed.end(), arrays.begin(), arrays.end() - 4 * kTableSurfels); // without tilts
  return packed;
}

TEST(TableFile, WhatIsPackedIsUnpackedWithinItsPrecision) {
  const reflectance::SharedReflectance shared = randomTables();
  const std::vector<std::byte> packed = packTables(shared);
  const reflectance::SharedReflectance got = unpackTables(packed, kTableSurfels);
  EXPECT_EQ(got.white, shared.white);
  EXPECT_EQ(got.tables.grid, shared.tables.grid);
  EXPECT_EQ(got.tables.values, shared.tables.values);
  EXPECT_EQ(got.trust, shared.trust);
  for (uint32_t i = 0; i < kTableSurfels; ++i) {
    EXPECT_NEAR(std::sin(got.fibres[i].radians() - shared.fibres[i].radians()), 0, 1e-4);
    EXPECT_NEAR(got.tilts[i].u, shared.tilts[i].u, 1e-4);
    EXPECT_EQ(got.tilts[i].v, 0.25f);
    EXPECT_EQ(got.mixtures[i].table, shared.mixtures[i].table);
    for (size_t m = 0; m < 3; ++m)
      EXPECT_NEAR(got.mixtures[i].weight[m], shared.mixtures[i].weight[m], 1 / 254.);
    EXPECT_NEAR(got.gains[i].r, shared.gains[i].r, 5e-4);
    EXPECT_EQ(got.gains[i].b, 20);
  }
  EXPECT_EQ(packTables(got), packed); // a model that is packed is the one that is opened
}

TEST(TableFile, DamageIsRefusedOrChangesNothingThatCannotBeUsed) {
  tryDamage(packTables(randomTables()), [&](std::span<const std::byte> damaged) {
    const reflectance::SharedReflectance got = unpackTables(damaged, kTableSurfels);
    for (const reflectance::TableMixture& mixture : got.mixtures)
      for (const uint16_t table : mixture.table) EXPECT_LT(table, got.tables.count());
    for (const auto& [r, g, b, _] : got.tables.values) EXPECT_TRUE(std::isfinite(r + g + b));
  });
}

TEST(TableFile, ErrorsNameTheFieldWhatWasFoundAndExpected) {
  const std::vector<std::byte> packed = packTables(randomTables());
  const auto complaintOf = [&](size_t at, uint8_t byte) {
    std::vector<std::byte> changed = packed;
    changed[at] = std::byte{byte};
    return image::errorOf([&] { unpackTables(changed, kTableSurfels); });
  };
  EXPECT_EQ(complaintOf(16, 4), "nodes: found 4, expected odd numbers");
  EXPECT_EQ(complaintOf(32, 0), "tables: found 0, expected 1..255");
  EXPECT_EQ(image::errorOf([&] { unpackTables(packed, 7); }), "surfels: found 40, expected 7");
  EXPECT_EQ(complaintOf(8, 4), "version: found 4, expected 1..3");
  EXPECT_EQ(complaintOf(packed.size() - 1, ~static_cast<uint8_t>(packed.back())),
            "arrays: found other content, expected a zlib stream of 2826 bytes");
  std::vector<std::byte> vast = packed; // tables of 255^4 nodes, refused before their memory is taken
  for (const size_t at : {16, 20, 24, 28}) vast[at] = std::byte{255};
  EXPECT_EQ(
      image::errorOf([&] { unpackTables(vast, kTableSurfels); }).rfind("arrays: found other content", 0), 0u);
  std::vector<std::byte> plain = uncompressed(packed);
  plain[plain.size() - 9 * kTableSurfels] ^= std::byte{1}; // a weight
  EXPECT_EQ(image::errorOf([&] { unpackTables(plain, kTableSurfels); }).rfind("weights[0]: found 25", 0), 0u);
}

TEST(TableFile, VersionOneHasTheSameArraysUncompressed) {
  const std::vector<std::byte> packed = packTables(randomTables()), plain = uncompressed(packed);
  reflectance::SharedReflectance withoutTilts = randomTables();
  withoutTilts.tilts.assign(kTableSurfels, {});
  EXPECT_EQ(packTables(unpackTables(plain, kTableSurfels)), packTables(withoutTilts));
  tryDamage(plain, [&](std::span<const std::byte> damaged) { unpackTables(damaged, kTableSurfels); });
}

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

namespace {

weights::VisibilityWeights randomFades(size_t surfels, size_t views, unsigned seed) {
  std::mt19937 random(seed);
  weights::VisibilityWeights visibility{views, std::vector<uint8_t>(surfels * views)};
  for (uint8_t& fade : visibility.values) fade = static_cast<uint8_t>(random());
  return visibility;
}

TEST(FadeFile, WhatIsPackedIsUnpackedEqual) {
  for (const auto& [surfels, views] :
       {std::pair<size_t, size_t>{0, 0}, {0, 5}, {1, 1}, {1000, 7}, {3, 400}, {20001, 16}, {20001, 33}}) {
    const weights::VisibilityWeights visibility = randomFades(surfels, views, 1);
    const weights::VisibilityWeights unpacked = unpackVisibility(packVisibility(visibility), surfels, views);
    EXPECT_EQ(unpacked.views, views);
    EXPECT_EQ(unpacked.values, visibility.values);
  }
}

TEST(FadeFile, OtherCountsAndEveryTruncationAreRefused) {
  const auto packed = packVisibility(randomFades(50, 4, 2));
  for (const auto& [surfels, views] : {std::pair<size_t, size_t>{50, 3}, {51, 4}, {0, 4}, {50, 0}})
    EXPECT_THROW(unpackVisibility(packed, surfels, views), Error);
  for (size_t length = 0; length < packed.size(); ++length)
    EXPECT_THROW(unpackVisibility(std::span(packed).first(length), 50, 4), Error);
  auto longer = packed;
  longer.push_back(std::byte{0});
  EXPECT_THROW(unpackVisibility(longer, 50, 4), Error);
  const auto wide = packVisibility(randomFades(50, 33, 2));
  for (const size_t views : {16, 32, 34}) EXPECT_THROW(unpackVisibility(wide, 50, views), Error);
}

TEST(FadeFile, AWrongChecksumIsRefused) {
  const auto packed = packVisibility(randomFades(50, 4, 2));
  for (size_t bit = 0; bit < 32; ++bit) {
    auto damaged = packed;
    damaged[packed.size() - 1 - bit / 8] ^= std::byte{1} << bit % 8;
    EXPECT_THROW(unpackVisibility(damaged, 50, 4), Error);
  }
}

TEST(FadeFile, CountsThatTheBytesCannotHoldTakeNoMemory) {
  const auto packed = packVisibility(randomFades(50, 4, 3));
  constexpr size_t huge = size_t{1} << 40;
  for (const auto& [surfels, views] :
       {std::pair<size_t, size_t>{huge, 1}, {1, huge}, {huge, huge}, {~size_t{0}, 2}})
    EXPECT_THROW(unpackVisibility(packed, surfels, views), Error);
}

TEST(FadeFile, BothWaysAskWhetherToGoOn) {
  const weights::VisibilityWeights visibility = randomFades(300000, 5, 4);
  constexpr int endless = std::numeric_limits<int>::max();
  Patience packing(endless), unpacking(endless);
  const auto packed = packVisibility(visibility, packing.progress());
  EXPECT_EQ(unpackVisibility(packed, 300000, 5, unpacking.progress()).values, visibility.values);
  for (const int questions : {0, packing.asks - 1})
    EXPECT_THROW(packVisibility(visibility, Patience(questions).progress()), Cancelled);
  for (const int questions : {0, unpacking.asks - 1})
    EXPECT_THROW(unpackVisibility(packed, 300000, 5, Patience(questions).progress()), Cancelled);
  EXPECT_GE(packing.asks, 6);
  EXPECT_GE(unpacking.asks, 6);
}

} // namespace

} // namespace surflect::model
