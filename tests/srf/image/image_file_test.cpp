#include "srf/image/image_file.h"

#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"

namespace surflect {
namespace {

class ImageFile : public testing::Test {
protected:
  TemporaryFolder folder;
};

TEST_F(ImageFile, TheExtensionChoosesTheFormat) {
  EXPECT_EQ(formatOf("a/b.EXR"), PictureFormat::exr);
  EXPECT_EQ(formatOf("b.Png"), PictureFormat::png);
  EXPECT_EQ(formatOf("exr.jpg"), PictureFormat::foreign);
  EXPECT_EQ(formatOf("exr"), PictureFormat::foreign);
}

TEST_F(ImageFile, ExrIsFloatWithPremultipliedAlpha) {
  const Image image = randomImage(4, 3, 4, -1, 9, 1);
  writeExr(folder / "a.exr", image, Precision::single);
  const Picture picture = readPicture(folder / "a.exr");
  EXPECT_TRUE(picture.isFloat() && picture.alphaPremultiplied && picture.hasAlpha());
  EXPECT_EQ(picture.image.values, image.values);
  EXPECT_EQ(readPictureSize(folder / "a.exr"), (PictureSize{4, 3}));
}

TEST_F(ImageFile, PngIsEncodedWithStraightAlpha) {
  for (const int bits : {8, 16}) {
    writePng(folder / "a.png", Image(4, 3, 2), bits);
    const Picture picture = readPicture(folder / "a.png");
    EXPECT_EQ(picture.bits, bits);
    EXPECT_TRUE(picture.hasAlpha() && !picture.alphaPremultiplied);
  }
  EXPECT_EQ(readPictureSize(folder / "a.png"), (PictureSize{4, 3}));
}

TEST_F(ImageFile, RadianceFilesKeepTheirRange) {
  std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
  for (const int byte : {128, 64, 32, 129, 128, 128, 128, 139}) file += static_cast<char>(byte);
  writeBytes(folder / "a.hdr", file);
  const Picture picture = readPicture(folder / "a.hdr");
  EXPECT_TRUE(picture.isFloat());
  ASSERT_EQ(picture.image.channels, 3);
  const float expected[] = {1, 0.5f, 0.25f, 1024, 1024, 1024}; // mantissa/256 * 2^(exponent - 128)
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(picture.image.values[i], expected[i]);
  EXPECT_EQ(readPictureSize(folder / "a.hdr"), (PictureSize{2, 1}));
}

TEST_F(ImageFile, ForeignIntegersAreEncodedValues) {
  writeBytes(folder / "a.ppm",
             std::string("P6\n2 1\n255\n") + '\xff' + '\x33' + '\x00' + '\x66' + '\x99' + '\xcc');
  const Picture picture = readPicture(folder / "a.ppm");
  EXPECT_EQ(picture.bits, 8);
  ASSERT_EQ(picture.image.channels, 3);
  const float expected[] = {1, 0.2f, 0, 0.4f, 0.6f, 0.8f};
  for (size_t i = 0; i < 6; ++i) EXPECT_FLOAT_EQ(picture.image.values[i], expected[i]);
}

// 32-bit Targa, whose alpha is straight.
TEST_F(ImageFile, ForeignStraightAlphaIsNotMultipliedIn) {
  std::string file(18, '\0');
  file[2] = 2;                    // true colour, not packed
  file[12] = file[14] = 1;        // 1 x 1
  file[16] = 32, file[17] = 0x28; // bits a pixel; eight of alpha, row 0 on top
  file += std::string("\x33\x66\xff\x80", 4);
  // The extension area that says what alpha means, and the footer that finds it.
  std::string extension(495, '\0');
  extension[0] = '\xef', extension[1] = '\x01', extension[494] = 3;
  std::string footer("\x16\0\0\0\0\0\0\0TRUEVISION-XFILE.\0", 26);
  writeBytes(folder / "a.tga", file + extension + footer);
  const Picture picture = readPicture(folder / "a.tga");
  ASSERT_EQ(picture.image.channels, 4);
  EXPECT_FALSE(picture.alphaPremultiplied);
  const float expected[] = {1, 0.4f, 0.2f, 128.f / 255};
  for (size_t i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(picture.image.values[i], expected[i]);
}

TEST_F(ImageFile, OtherFormatsAreNotTried) {
  writePng(folder / "a.png", Image(4, 3, 3));
  for (const char* name : {"a.dpx", "a.psd", "a.gif", "a", "a.jpg"}) { // also not under another name
    std::filesystem::copy(folder / "a.png", folder / name);
    EXPECT_NE(errorOf([&] { readPicture(folder / name); }).find(name), std::string::npos);
  }
}

TEST_F(ImageFile, MemoryIsNotTakenForPixelsThatTheFileHasNoBytesFor) {
  writeBytes(folder / "a.ppm", "P6\n16000 16000\n255\n12345");
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.ppm"); }).find("for so many pixels"), std::string::npos);
}

TEST_F(ImageFile, WhatIsNoPictureIsRejectedInOneLine) {
  writeBytes(folder / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X 9\n");
  writeBytes(folder / "a.jpg", "no picture");
  writeBytes(folder / "a.txt", "no picture");
  for (const char* name : {"a.hdr", "a.jpg", "a.txt", "missing.jpg", "missing.exr", "missing.png"})
    EXPECT_NE(errorOf([&] { readPicture(folder / name); }).find(name), std::string::npos);
}

} // namespace
} // namespace surflect
