#include "render/lightfield/slf/field_file.h"

#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::slf {
namespace {

std::vector<Texel> randomTexels(std::mt19937& random, size_t count) {
  std::uniform_int_distribution<int> finite(0, 0x7bff); // halves up to 65504
  std::vector<Texel> texels(count);
  for (Texel& texel : texels)
    for (uint16_t& half : texel) half = static_cast<uint16_t>(finite(random));
  return texels;
}

class TextureFileTest : public ::testing::Test {
protected:
  std::filesystem::path file() const { return folder_ / "textures.bin"; }
  void write(std::span<const Texel> texels) const {
    TextureWriter writer(file());
    writer.append(texels);
    writer.commit();
  }
  // Textures of regions of some texels each.
  TextureFile open(TexturePlaces places, std::initializer_list<int> sizes) const {
    std::vector<Region> regions;
    for (const int size : sizes) {
      regions.emplace_back();
      regions.back().chart.width = size, regions.back().chart.height = 1;
    }
    return {OpenFile(file()), std::move(places), regions};
  }
  image::TemporaryFolder folder_;
};

TEST_F(TextureFileTest, ReadingReturnsWhatWasWrittenAtItsPlace) {
  std::mt19937 random(1);
  const std::vector<std::vector<Texel>> textures{randomTexels(random, 6), randomTexels(random, 6),
                                                 randomTexels(random, 20)};
  TextureWriter writer(file());
  std::vector<uint64_t> places;
  for (const std::vector<Texel>& texture : textures) places.push_back(writer.append(texture));
  EXPECT_EQ(places, (std::vector<uint64_t>{0, 6, 12}));
  EXPECT_EQ(writer.texels(), 32u);
  EXPECT_FALSE(std::filesystem::exists(file()));
  writer.commit();

  const TextureFile stored = open({{places[1], kNotStored, places[0]}, {places[2]}}, {6, 20});
  EXPECT_EQ(stored.read(0, 0), textures[1]);
  EXPECT_EQ(stored.read(0, 1), std::vector<Texel>(6));
  EXPECT_EQ(stored.read(0, 2), textures[0]);
  EXPECT_EQ(stored.read(1, 0), textures[2]);
}

TEST_F(TextureFileTest, TexturesAreReplacedInTheirPlaceWhileOthersAreAppended) {
  std::mt19937 random(5);
  const std::vector<Texel> first = randomTexels(random, 6), second = randomTexels(random, 9),
                           third = randomTexels(random, 4), other = randomTexels(random, 9);
  TextureWriter writer(file());
  writer.append(first);
  const uint64_t place = writer.append(second);
  EXPECT_EQ(writer.read(0, 6), first);
  EXPECT_EQ(writer.read(place, 9), second);
  writer.replace(place, other);
  EXPECT_EQ(writer.append(third), 15u);
  EXPECT_EQ(writer.read(place, 9), other);
  EXPECT_EQ(writer.read(15, 4), third);
  writer.commit();
  const TextureFile stored = open({{0}, {place}, {15}}, {6, 9, 4});
  EXPECT_EQ(stored.read(0, 0), first);
  EXPECT_EQ(stored.read(1, 0), other);
  EXPECT_EQ(stored.read(2, 0), third);
}

TEST_F(TextureFileTest, ErrorsOfReadingAgainNameTheFileThatIsMade) {
  TextureWriter writer(file());
  writer.append(std::vector<Texel>(3));
  EXPECT_EQ(image::errorOf([&] { writer.read(2, 5); }), file().string() + ": cannot read textures again");
}

TEST_F(TextureFileTest, TexelsThatAreNotFiniteAreRefused) {
  std::mt19937 random(2);
  for (const int half : {0x7c00, 0xfc00, 0x7e00}) { // both infinities, and NaN
    std::vector<Texel> texels = randomTexels(random, 8);
    texels[5][2] = static_cast<uint16_t>(half);
    write(texels);
    const TextureFile stored = open({{0, 4}}, {4});
    EXPECT_EQ(stored.read(0, 0).size(), 4u);
    EXPECT_EQ(image::errorOf([&] { stored.read(0, 1); }),
              file().string() + ": texture 1 of region 0.texel 5: is not finite");
  }
}

TEST_F(TextureFileTest, AFileThatBecomesShorterIsAnError) {
  std::mt19937 random(3);
  write(randomTexels(random, 8));
  const TextureFile stored = open({{0, 4}}, {4});
  std::filesystem::resize_file(file(), 7 * sizeof(Texel));
  EXPECT_EQ(image::errorOf([&] { stored.read(0, 0); }),
            file().string() + ": texture 0 of region 0: has been written to since it was opened");
  EXPECT_EQ(image::errorOf([&] { stored.read(0, 1); }),
            file().string() + ": texture 1 of region 0: has become shorter");
}

} // namespace
} // namespace surflect::slf
