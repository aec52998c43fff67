#include "render/lightfield/spherical/spherical_file.h"

#include "render/lightfield/spherical/build.h"
#include "surfel/base/error.h"
#include "tests/support/synthetic_capture.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace surflect::spherical {

namespace {

Tile randomTile(int size, unsigned seed) {
  std::mt19937 random(seed);
  Tile tile;
  for (int i = 0; i < size * size; ++i) {
    Texel texel{};
    if (random() % 3 > 0) {
      for (size_t channel = 0; channel < 3; ++channel)
        texel[channel] = static_cast<uint16_t>(random() % 0x7bff);
      texel[3] = 0x3c00;
    }
    tile.colors.push_back(texel);
    tile.heights.push_back(static_cast<Height>(random()));
  }
  return tile;
}

TEST(TileCoding, ReturnsTheTexelsExactly) {
  for (const int size : {1, 8, 32}) {
    const Tile tile = randomTile(size, 8);
    EXPECT_EQ(decoded(encoded(tile, size), size), tile);
  }
}

TEST(TileCoding, SmoothImagesTakeFewBytes) {
  Tile tile;
  for (int i = 0; i < 64 * 64; ++i) {
    const auto value = static_cast<uint16_t>(0x3000 + i % 64);
    tile.colors.push_back({value, value, value, 0x3c00});
    tile.heights.push_back(static_cast<Height>(30000 + 3 * (i % 64)));
  }
  EXPECT_LT(encoded(tile, 64).size(), 64u * 64 * sizeof(Texel) / 50);
}

TEST(TileCoding, OtherSizesAndTruncationsAreRefused) {
  const auto bytes = encoded(randomTile(8, 9), 8);
  EXPECT_THROW(decoded(bytes, 16), Error);
  EXPECT_THROW(decoded(bytes, 4), Error);
  for (size_t length = 0; length < bytes.size(); ++length)
    EXPECT_THROW(decoded(std::span(bytes).first(length), 8), Error);
}

TEST(TileCoding, TexelsThatAreNoColoursAreRefused) {
  for (const Texel& bad : {Texel{0x7c00, 0, 0, 0x3c00}, Texel{0, 0xffff, 0, 0}, Texel{0, 0, 0, 0x3c01},
                           Texel{0, 0, 0, 0xbc00}}) {
    Tile tile = randomTile(8, 10);
    tile.colors[20] = bad;
    EXPECT_THROW(decoded(encoded(tile, 8), 8), Error);
  }
}

} // namespace

namespace {

namespace fs = std::filesystem;

constexpr BuildOptions kBuildOptions{.levels = 2, .size = 16};

// A small field on disk, built once.
class SphericalFileTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    shared_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 8, .lights = 0, .size = 24}, *shared_ / "capture");
    report_ = build(lightfield::Views(*shared_ / "capture"), kBuildOptions, {}, *shared_ / "field");
  }
  static void TearDownTestSuite() { shared_.reset(); }
  void SetUp() override { fs::copy(*shared_ / "field", folder_.path(), fs::copy_options::recursive); }

  static SphericalFile opened(const fs::path& path) {
    return SphericalFile(lightfield::LightFieldFolder(path, kFormat, kVersion));
  }
  std::string errorOfOpening() const {
    return image::errorOf([&] { opened(folder_.path()); });
  }
  // Opens and reads all images.
  std::string errorOfReading() const {
    return image::errorOf([&] {
      const SphericalFile file = opened(folder_.path());
      for (ImageNumber image = 0; image < file.shape().images(); ++image) file.read(image);
    });
  }
  fs::path tiles() const { return folder_.path() / "level1.tiles"; }

  static inline std::unique_ptr<image::TemporaryFolder> shared_;
  static inline BuildReport report_;
  image::TemporaryFolder folder_;
};

TEST_F(SphericalFileTest, IsReadAsItWasBuilt) {
  const SphericalFile file = opened(folder_.path());
  EXPECT_EQ(file.shape().levels, 2u);
  EXPECT_EQ(file.shape().size, 16);
  EXPECT_EQ(file.shape().sphere.middle, report_.shape.sphere.middle);
  EXPECT_EQ(file.shape().sphere.radius, report_.shape.sphere.radius);
  size_t opaque = 0;
  for (ImageNumber image = 0; image < file.shape().images(); ++image) {
    const PencilImage read = file.read(image);
    ASSERT_EQ(read.mips.size(), 5u);
    for (const Texel& texel : read.mips[0].colors) opaque += texel[3] != 0;
  }
  EXPECT_EQ(opaque, report_.seen + report_.unseen);
}

TEST_F(SphericalFileTest, BuildingAgainGivesTheSameBits) {
  build(lightfield::Views(*shared_ / "capture"), kBuildOptions, {}, *shared_ / "again");
  EXPECT_EQ(image::contentOf(*shared_ / "again"), image::contentOf(*shared_ / "field"));
}

TEST_F(SphericalFileTest, EveryTruncationIsRefusedWhenItIsOpened) {
  const std::string content = readFile(tiles());
  for (size_t length = 0; length < content.size(); length += std::max<size_t>(1, content.size() / 300)) {
    fs::resize_file(tiles(), length);
    EXPECT_NE(errorOfOpening().find("level1.tiles: "), std::string::npos) << length;
  }
}

TEST_F(SphericalFileTest, EveryFlippedByteIsNoticed) {
  const std::string content = readFile(tiles());
  for (size_t place = 0; place < content.size(); place += std::max<size_t>(1, content.size() / 200)) {
    std::string damaged = content;
    damaged[place] = static_cast<char>(damaged[place] ^ 0x10);
    std::ofstream(tiles(), std::ios::binary) << damaged;
    EXPECT_NE(errorOfReading().find("level1.tiles: "), std::string::npos) << place;
  }
}

TEST_F(SphericalFileTest, ErrorsNameTheTile) {
  std::string content = readFile(tiles());
  content[2] = static_cast<char>(content[2] ^ 1);
  std::ofstream(tiles(), std::ios::binary) << content;
  EXPECT_NE(errorOfReading().find("level1.tiles: tile[0].checksum: found "), std::string::npos);
}

TEST_F(SphericalFileTest, AMissingLevelIsNamed) {
  fs::remove(tiles());
  EXPECT_NE(errorOfOpening().find("level1.tiles: cannot open"), std::string::npos);
}

TEST_F(SphericalFileTest, LevelsOfAnotherSizeAreRefused) {
  build(lightfield::Views(*shared_ / "capture"), {.levels = 2, .size = 8}, {}, *shared_ / "small");
  fs::copy_file(*shared_ / "small" / "level1.tiles", tiles(), fs::copy_options::overwrite_existing);
  EXPECT_NE(errorOfOpening().find("level1.tiles: size of a tile: found 8, expected 16"), std::string::npos)
      << errorOfOpening();
}

TEST_F(SphericalFileTest, OptionsOutOfRangeAreRefused) {
  const lightfield::Views views(*shared_ / "capture");
  for (const BuildOptions& options : {BuildOptions{.levels = 0}, BuildOptions{.levels = 7},
                                      BuildOptions{.size = 48}, BuildOptions{.size = 4}})
    EXPECT_THROW(build(views, options, {}, *shared_ / "never"), Error);
  EXPECT_FALSE(fs::exists(*shared_ / "never"));
}

} // namespace

} // namespace surflect::spherical
