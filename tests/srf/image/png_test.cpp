#include "srf/image/png.h"

#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

namespace surflect::image {
namespace {

std::string bytesOf(std::string_view hex) {
  std::string bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

// Written by hand: a 2-bit palette of which one entry is translucent, Adam7 rows, and a tiny file that claims
// 16000 x 16000 pixels.
const std::string palette =
    bytesOf("89504e470d0a1a0a0000000d4948445200000003000000010203000000668efc270000000950"
            "4c5445ff000000ff000000ff2d4acd8a0000000274524e53ff335a67515c0000000a49444154"
            "789c63900000001a00192d88f4360000000049454e44ae426082");
const std::string interlaced =
    bytesOf("89504e470d0a1a0a0000000d49484452000000030000000308000000010444daf50000001749"
            "444154789c6360601061b00960e062706390d330020008a701693ddf9762000000004945"
            "4e44ae426082");
const std::string huge =
    bytesOf("89504e470d0a1a0a0000000d4948445200003e8000003e800806000000417edfde0000000c49444154"
            "789c6360a03d00000064000186643c350000000049454e44ae426082");

class Png : public ::testing::Test {
protected:
  PngPicture read(const std::string& bytes) const {
    writeBytes(folder / "a.png", bytes);
    return readPng(folder / "a.png");
  }

  TemporaryFolder folder;
};

TEST_F(Png, SamplesSurviveARoundTrip) {
  for (const int bitDepth : {8, 16})
    for (int channels = 1; channels <= 4; ++channels) {
      Image image = randomImage(7, 5, channels, 0, 1, 3);
      const float white = bitDepth == 8 ? 255 : 65535;
      for (float& v : image.values) v = std::round(v * white) / white;
      writePng(folder / "a.png", image, bitDepth);
      const PngPicture back = readPng(folder / "a.png");
      EXPECT_EQ(back.bitDepth, bitDepth);
      EXPECT_EQ(back.image.channels, channels);
      EXPECT_EQ(back.image.values, image.values);
    }
}

TEST_F(Png, ValuesAreRoundedAndClamped) {
  const Image image = randomImage(40, 30, 3, -0.5f, 1.5f, 4);
  writePng(folder / "a.png", image);
  const PngPicture back = readPng(folder / "a.png");
  for (size_t i = 0; i < image.values.size(); ++i)
    EXPECT_NEAR(back.image.values[i], std::clamp(image.values[i], 0.f, 1.f), 0.5001f / 255);
}

TEST_F(Png, PalettesAndTheirTransparencyAreExpanded) {
  const PngPicture picture = read(palette);
  EXPECT_EQ(picture.bitDepth, 8);
  ASSERT_EQ(picture.image.channels, 4);
  EXPECT_EQ(picture.image.values, std::vector<float>({1, 0, 0, 1, 0, 1, 0, 0.2f, 0, 0, 1, 1}));
}

TEST_F(Png, InterlacedRowsComeInOrder) {
  const PngPicture picture = read(interlaced);
  ASSERT_EQ(picture.image.channels, 1);
  for (int i = 0; i < 9; ++i)
    EXPECT_FLOAT_EQ(picture.image.at(i % 3, i / 3)[0], 10 * static_cast<float>(i) / 255);
}

TEST_F(Png, TheSizeIsKnownWithoutThePixels) {
  writePng(folder / "a.png", Image(13, 6, 3));
  EXPECT_EQ(readPngHeader(folder / "a.png").width, 13);
  EXPECT_EQ(readPngHeader(folder / "a.png").height, 6);
}

TEST_F(Png, AlphaIsKnownWithoutThePixels) {
  for (const int channels : {1, 2, 3, 4}) {
    writePng(folder / "a.png", Image(2, 2, channels));
    EXPECT_EQ(readPngHeader(folder / "a.png").hasAlpha, channels % 2 == 0) << channels;
  }
  writeBytes(folder / "a.png", palette); // with a transparent colour
  EXPECT_TRUE(readPngHeader(folder / "a.png").hasAlpha);
}

TEST_F(Png, EveryTruncationIsRejected) {
  for (const std::string& whole : {palette, interlaced})
    for (size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(errorOf([&] { read(whole.substr(0, length)); }).find("a.png: cannot read"),
                std::string::npos);
}

TEST_F(Png, EveryFlippedBitIsRejected) {
  for (size_t bit = 0; bit < 8 * interlaced.size(); ++bit) {
    std::string damaged = interlaced;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    EXPECT_NE(errorOf([&] { read(damaged); }), "") << "bit " << bit;
  }
}

TEST_F(Png, AClaimThatTheFileCannotHoldIsRejectedBeforeMemoryIsTaken) {
  EXPECT_NE(errorOf([&] { read(huge); }).find("truncated"), std::string::npos);
}

TEST_F(Png, AMissingFileIsNamed) {
  EXPECT_NE(errorOf([&] { readPng(folder / "none.png"); }).find("none.png"), std::string::npos);
  EXPECT_NE(errorOf([&] { readPngHeader(folder / "none.png"); }).find("none.png"), std::string::npos);
}

} // namespace
} // namespace surflect::image
