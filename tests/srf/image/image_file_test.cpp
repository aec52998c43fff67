#include "srf/image/image_file.h"

#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"

#include <sys/stat.h>

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

// Pixels that are numbered as they are looked at, written in every order of scanlines.
TEST_F(ImageFile, RadianceFilesAreUprightHoweverTheirScanlinesFollow) {
  constexpr int width = 3, height = 2;
  for (const bool columns : {false, true})
    for (const bool upwards : {false, true})
      for (const bool leftwards : {false, true}) {
        const std::string y = upwards ? "+Y 2" : "-Y 2", x = leftwards ? "-X 3" : "+X 3";
        std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
        file += (columns ? x + " " + y : y + " " + x) + "\n";
        for (int i = 0; i < width * height; ++i) {
          const int along = columns ? i / height : i % width, down = columns ? i % height : i / width;
          const int shownX = leftwards ? width - 1 - along : along,
                    shownY = upwards ? height - 1 - down : down;
          const char number = static_cast<char>(1 + shownY * width + shownX);
          file += {number, 0, 0, static_cast<char>(136)}; // an exponent of 8: the mantissa itself
        }
        writeBytes(folder / "a.hdr", file);
        EXPECT_EQ(readPictureSize(folder / "a.hdr"), (PictureSize{width, height})) << y << x << columns;
        const Picture picture = readPicture(folder / "a.hdr");
        ASSERT_EQ(picture.image.width, width);
        for (int i = 0; i < width * height; ++i)
          EXPECT_EQ(picture.image.at(i % width, i / width)[0], static_cast<float>(i + 1))
              << y << x << columns;
      }
}

TEST_F(ImageFile, RadianceFilesAreDividedByTheirExposures) {
  const auto file = [](const std::string& lines) {
    return "#?RADIANCE\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x40\x20\x81";
  };
  writeBytes(folder / "a.hdr", file("EXPOSURE=2\nEXPOSURE= 4.0\n"));
  EXPECT_EQ(readPicture(folder / "a.hdr").image.values, (std::vector{0.125f, 0.0625f, 0.03125f}));
  for (const char* exposure : {"0", "-1", "inf", "bright"}) {
    writeBytes(folder / "a.hdr", file(std::string("EXPOSURE=") + exposure + "\n"));
    EXPECT_NE(errorOf([&] {
                readPicture(folder / "a.hdr");
              }).find(std::string("a.hdr: cannot read (EXPOSURE: found '") + exposure + "', expected"),
              std::string::npos);
  }
}

// A calibrated camera's lens is in pixels of its sensor, whichever side up it was held.
TEST_F(ImageFile, PhotographsAreNotTurnedAsExifWouldHaveThem) {
  const auto segment = [](char marker, const std::string& content) {
    const auto length = static_cast<char>(content.size() + 2); // all are short
    return std::string("\xff") + marker + '\0' + length + content;
  };
  using namespace std::string_literals;
  const std::string turned = "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"s;
  // 16 x 8 pixels of gray, two blocks: 128 and 192.
  std::string file = "\xff\xd8"s + segment('\xe1', turned) + segment('\xdb', '\0' + std::string(64, '\x08'));
  file += segment('\xc0', "\x08\0\x08\0\x10\x01\x01\x11\0"s);
  file += segment('\xc4', "\0\0\x02"s + std::string(14, '\0') + "\0\x07"s); // 00: no difference; 01: 7 bits
  file += segment('\xc4', "\x10\x01"s + std::string(15, '\0') + "\0"s);     // 0: the end of a block
  file += segment('\xda', "\x01\x01\0\0\x3f\0"s) + "\x0c\x07\xff\xd9"s;
  writeBytes(folder / "a.jpg", file);
  const Picture picture = readPicture(folder / "a.jpg");
  EXPECT_EQ(readPictureSize(folder / "a.jpg"), (PictureSize{16, 8}));
  EXPECT_EQ(readPictureHeader(folder / "a.jpg").orientation, 6);
  ASSERT_EQ(picture.image.width, 16);
  EXPECT_FLOAT_EQ(picture.image.at(2, 4)[0], 128.f / 255);
  EXPECT_FLOAT_EQ(picture.image.at(13, 4)[0], 192.f / 255);
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
  // OpenImageIO would take 256 rows of these.
  writeBytes(folder / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 33333333\n12345");
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.hdr"); }).find("65536 each way"), std::string::npos);
}

TEST_F(ImageFile, WhatIsNoPictureIsRejectedInOneLine) {
  writeBytes(folder / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X 9\n");
  writeBytes(folder / "a.jpg", "no picture");
  writeBytes(folder / "a.txt", "no picture");
  for (const char* name : {"a.hdr", "a.jpg", "a.txt", "missing.jpg", "missing.exr", "missing.png"})
    EXPECT_NE(errorOf([&] { readPicture(folder / name); }).find(name), std::string::npos);
}

TEST_F(ImageFile, WhatIsThereButNoFileIsCalledWhatItIs) {
  for (const char* extension : {".hdr", ".exr", ".png"}) {
    const auto complaint = [&](const std::string& name) {
      return errorOf([&] { readPicture(folder / (name + extension)); });
    };
    const auto line = [&](const std::string& name, const std::string& problem) {
      return (folder / (name + extension)).string() + ": " + problem;
    };
    std::filesystem::create_directory(folder / (std::string("folder") + extension));
    ASSERT_EQ(::mkfifo((folder / (std::string("pipe") + extension)).c_str(), 0600), 0);
    EXPECT_EQ(complaint("folder"), line("folder", "cannot read (a folder)"));
    EXPECT_EQ(complaint("pipe"), line("pipe", "cannot read (not a regular file)"));
    EXPECT_EQ(complaint("missing"), line("missing", "cannot open (No such file or directory)"));
  }
}

} // namespace
} // namespace surflect
