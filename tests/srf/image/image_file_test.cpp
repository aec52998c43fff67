#include "srf/image/image_file.h"

#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"
#include "tests/srf/image/foreign_files.h"
#include "tests/support/color_files.h"

#include <Eigen/LU>
#include <sys/stat.h>

namespace surflect::image {
namespace {

class ImageFile : public ::testing::Test {
protected:
  TemporaryFolder folder;
};

TEST_F(ImageFile, TheExtensionChoosesTheFormat) {
  EXPECT_EQ(formatOf("a/b.EXR"), PictureFormat::exr);
  EXPECT_EQ(formatOf("b.Png"), PictureFormat::png);
  EXPECT_EQ(formatOf("b.HDR"), PictureFormat::radiance);
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
  const auto file = [](const std::string& lines) { return radianceFile(lines, "\x80\x40\x20\x81"); };
  writeBytes(folder / "a.hdr", file("EXPOSURE=2\nEXPOSURE= 4.0\n"));
  EXPECT_EQ(readPicture(folder / "a.hdr").image.values, (std::vector{0.125f, 0.0625f, 0.03125f}));
  writeBytes(folder / "a.hdr", file("COLORCORR=0.5 1 2\nEXPOSURE=2\nCOLORCORR= 1 1 0.25\n"));
  EXPECT_EQ(readPicture(folder / "a.hdr").image.values, (std::vector{1.f, 0.25f, 0.25f}));
  for (const char* exposure : {"0", "-1", "inf", "bright"}) {
    writeBytes(folder / "a.hdr", file(std::string("EXPOSURE=") + exposure + "\n"));
    EXPECT_NE(errorOf([&] {
                readPicture(folder / "a.hdr");
              }).find(std::string("a.hdr: EXPOSURE: found '") + exposure + "', expected"),
              std::string::npos);
  }
}

TEST_F(ImageFile, RadianceFilesSayTheirColours) {
  const std::string gray = "\x80\x80\x80\x80"; // 1/2
  const auto color = [&](const std::string& file) {
    writeBytes(folder / "a.hdr", file);
    const auto header = readPictureHeader(folder / "a.hdr");
    EXPECT_EQ(header.bits, 0);
    return header.color;
  };
  EXPECT_FALSE(color(radianceFile("", gray)));
  EXPECT_EQ(color(radianceFile("PRIMARIES=0.708 0.292 0.17 0.797 0.131 0.046 0.3127 0.329\n", gray))
                ->encoding.primaries,
            kRec2020);
  EXPECT_EQ(color(radianceFile("PRIMARIES=0.708 0.292\n", gray))->problem,
            "found '0.708 0.292', expected 8 numbers");
  const Mat3<double> rgbFromXyz = xyzFromRgb(kRec709).inverse();
  for (const std::string mantissas : {"\x79\x80\x8b", "\xd0\x20\x08"}) { // nearly D65, and a red
    EXPECT_EQ(color(radianceFile("", mantissas + "\x80", "32-bit_rle_xyze"))->source, "Radiance XYZE");
    const auto at = [&](size_t i) { return static_cast<uint8_t>(mantissas[i]) / 256.; };
    const Vec3<double> expected = rgbFromXyz * Vec3<double>(at(0), at(1), at(2));
    for (int c = 0; const float value : readPicture(folder / "a.hdr").image.values)
      EXPECT_NEAR(value, expected[c++], 1e-6);
  }
  writeBytes(folder / "a.hdr", radianceFile("", gray, "32-bit_rle_luv"));
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.hdr"); }).find("FORMAT: found '32-bit_rle_luv', expected"),
            std::string::npos);
}

TEST_F(ImageFile, RadianceFilesAreLinear) {
  writeBytes(folder / "a.hdr", radianceFile("GAMMA=1\n", "\x80\x80\x80\x80"));
  EXPECT_EQ(readPicture(folder / "a.hdr").image.values, std::vector<float>(3, 0.5f));
  writeBytes(folder / "a.hdr", radianceFile("GAMMA=2.2\n", "\x80\x80\x80\x80"));
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.hdr"); }).find("a.hdr: GAMMA: found '2.2', expected 1"),
            std::string::npos);
}

TEST_F(ImageFile, RadianceHeadersCanEndTheirLinesAsOtherSystemsDo) {
  std::string file = radianceFile("EXPOSURE=2\n", "\x80\x80\x80\x80");
  for (size_t at = 0; (at = file.find('\n', at)) != file.npos; at += 2) file.insert(at, "\r");
  writeBytes(folder / "a.hdr", file);
  EXPECT_EQ(readPicture(folder / "a.hdr").image.values, std::vector<float>(3, 0.25f));
}

TEST_F(ImageFile, RadianceRunsAreUnrolled) {
  // Bytes apart: 8 pixels; then the older way, whose runs repeat the pixel before.
  const std::string head = "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n";
  std::string planes = {2, 2, 0, 8, '\x88', 64, 4, 1, 2, 3, 4, '\x84', 5, '\x88', 0, '\x88', '\x88'};
  writeBytes(folder / "a.hdr", head + planes);
  const Image image = readPicture(folder / "a.hdr").image;
  for (int x = 0; x < 8; ++x) {
    EXPECT_EQ(image.at(x, 0)[0], 64);
    EXPECT_EQ(image.at(x, 0)[1], x < 4 ? static_cast<float>(x + 1) : 5);
    EXPECT_EQ(image.at(x, 0)[2], 0);
  }
  const std::string pixels = {7, 8, 9, '\x88', 1, 1, 1, 7};
  writeBytes(folder / "a.hdr", head + pixels);
  const Image older = readPicture(folder / "a.hdr").image;
  for (int x = 0; x < 8; ++x) EXPECT_EQ(older.at(x, 0)[2], 9);
  for (const std::string& whole : {planes, pixels})
    for (size_t length = 0; length < whole.size(); ++length) {
      writeBytes(folder / "a.hdr", head + whole.substr(0, length));
      EXPECT_NE(
          errorOf([&] { readPicture(folder / "a.hdr"); }).find("a.hdr: cannot read (the file is truncated)"),
          std::string::npos);
    }
  planes[4] = '\x89'; // nine of eight
  writeBytes(folder / "a.hdr", head + planes);
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.hdr"); }).find("a run leaves its scanline"),
            std::string::npos);
}

// A calibrated camera's lens is in pixels of its sensor, whichever side up it was held.
TEST_F(ImageFile, PhotographsAreNotTurnedAsExifWouldHaveThem) {
  using namespace std::string_literals;
  const std::string turned = "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"s;
  writeBytes(folder / "a.jpg", grayJpeg(jpegSegment('\xe1', turned)));
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

TEST_F(ImageFile, ForeignStraightAlphaIsNotMultipliedIn) {
  writeBytes(folder / "a.tga", targaFile(8, "\x33\x66\xff\x80", 3));
  const Picture picture = readPicture(folder / "a.tga");
  ASSERT_EQ(picture.image.channels, 4);
  EXPECT_FALSE(picture.alphaPremultiplied);
  const float expected[] = {1, 0.4f, 0.2f, 128.f / 255};
  for (size_t i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(picture.image.values[i], expected[i]);
}

TEST_F(ImageFile, AlphaOfTargasIsWhatTheyDeclare) {
  const auto channels = [&](const std::string& file, bool premultiplied = false) {
    writeBytes(folder / "a.tga", file);
    const Picture picture = readPicture(folder / "a.tga");
    EXPECT_EQ(picture.alphaPremultiplied, premultiplied);
    EXPECT_EQ(readPictureHeader(folder / "a.tga").hasAlpha, picture.hasAlpha());
    EXPECT_EQ(readPictureSize(folder / "a.tga"), (PictureSize{2, 1}));
    for (size_t c = 0; c < 3; ++c)
      EXPECT_FLOAT_EQ(picture.image.values[c], (48.f - 16 * static_cast<float>(c)) / 255);
    return picture.image.channels;
  };
  using namespace std::string_literals;
  const std::string zero = "\x10\x20\x30\0\x11\x21\x31\0"s, full = "\x10\x20\x30\xff\x11\x21\x31\xff"s,
                    varied = "\x10\x20\x30\xff\x11\x21\x31\x40"s;
  // Without an extension area: by the header's bits of alpha, or where it varies.
  EXPECT_EQ(channels(targaFile(0, zero)), 3);
  EXPECT_EQ(channels(targaFile(0, full)), 3);
  EXPECT_EQ(channels(targaFile(0, varied)), 4);
  EXPECT_EQ(channels(targaFile(8, zero)), 3);
  EXPECT_EQ(channels(targaFile(8, full)), 4);
  EXPECT_EQ(channels(targaFile(8, varied)), 4);
  // Its types: none, undefined twice, straight and premultiplied.
  EXPECT_EQ(channels(targaFile(8, full, 0)), 3);
  EXPECT_EQ(channels(targaFile(8, varied, 0)), 4);
  EXPECT_EQ(channels(targaFile(8, varied, 1)), 3);
  EXPECT_EQ(channels(targaFile(8, varied, 2)), 3);
  EXPECT_EQ(channels(targaFile(8, zero, 3)), 3);
  EXPECT_EQ(channels(targaFile(8, full, 3)), 4);
  EXPECT_EQ(channels(targaFile(8, full, 4), true), 4);
}

TEST_F(ImageFile, AlphaOfTiffIsStraightOrNotAsItSays) {
  for (const uint32_t kind : {1u, 2u}) {
    writeBytes(folder / "a.tif",
               tiffFile({.channels = 4, .extraSample = kind, .pixels = "\x40\x20\x10\x80"}));
    const Picture picture = readPicture(folder / "a.tif");
    ASSERT_EQ(picture.image.channels, 4);
    EXPECT_EQ(picture.alphaPremultiplied, kind == 1);
    const float expected[] = {64, 32, 16, 128};
    for (size_t i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(picture.image.values[i], expected[i] / 255);
  }
}

TEST_F(ImageFile, AlphaOfBitmapsIsWhatTheHeaderDeclares) {
  const auto channels = [&](const std::string& file) {
    writeBytes(folder / "a.bmp", file);
    const Picture picture = readPicture(folder / "a.bmp");
    EXPECT_FALSE(picture.alphaPremultiplied);
    EXPECT_EQ(readPictureHeader(folder / "a.bmp").hasAlpha, picture.hasAlpha());
    EXPECT_FLOAT_EQ(picture.image.values[0], 48.f / 255);
    EXPECT_FLOAT_EQ(picture.image.values[2], 16.f / 255);
    return picture.image.channels;
  };
  using namespace std::string_literals;
  const std::string zero = "\x10\x20\x30\0\x11\x21\x31\0"s, full = "\x10\x20\x30\xff\x11\x21\x31\xff"s,
                    varied = "\x10\x20\x30\xff\x11\x21\x31\x40"s;
  EXPECT_EQ(channels(bmpFile(40, zero)), 3); // the fourth byte is not used
  EXPECT_EQ(channels(bmpFile(40, full)), 3);
  EXPECT_EQ(channels(bmpFile(40, varied)), 4); // but written by some
  EXPECT_EQ(channels(bmpFile(108, zero)), 3);
  EXPECT_EQ(channels(bmpFile(108, full)), 4);
  EXPECT_EQ(channels(bmpFile(108, varied)), 4);
  EXPECT_EQ(channels(bmpFile(108, full, 0)), 3);
  writeBytes(folder / "a.bmp", bmpFile(108, full, 0xff000000, 0xff));
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.bmp"); }).find("a.bmp: masks: found 000000ff, "),
            std::string::npos);
}

TEST_F(ImageFile, ProfilesOfTiffAndJpegAreTheirStatements) {
  const std::string profile = profileBytes(kDisplayP3, ProfileCurve::srgb);
  writeBytes(folder / "a.tif",
             tiffFile({.bits = 16, .pixels = "\xff\xff\x01\x02\x03\x04", .iccProfile = profile}));
  const Picture tiff = readPicture(folder / "a.tif");
  EXPECT_EQ(tiff.bits, 16);
  EXPECT_EQ(tiff.color->source, "TIFF ICC profile");
  EXPECT_EQ(tiff.color->problem, "");
  EXPECT_EQ(readPictureHeader(folder / "a.tif").color->source, "TIFF ICC profile");
  const auto inJpeg = [](const std::string& bytes) {
    return grayJpeg(jpegSegment('\xe2', std::string("ICC_PROFILE\0\1\1", 14) + bytes));
  };
  writeBytes(folder / "a.jpg", inJpeg(grayProfileBytes(2)));
  EXPECT_EQ(readPicture(folder / "a.jpg").color->problem, "");
  writeBytes(folder / "a.jpg", inJpeg(profile));
  EXPECT_NE(readPictureHeader(folder / "a.jpg").color->problem.find("'RGB' of 'made by a test'"),
            std::string::npos);
}

TEST_F(ImageFile, ExifSaysWhatCamerasWithoutProfilesMean) {
  const auto color = [&](uint32_t space, const std::string& index) {
    writeBytes(folder / "a.jpg", grayJpeg(exifSegment(space, index)));
    return *readPictureHeader(folder / "a.jpg").color;
  };
  EXPECT_EQ(color(1, "R98").encoding.transfer, Transfer{Transfer::Curve::srgb});
  EXPECT_EQ(color(0xffff, "R03").encoding.primaries, kAdobeRgb);
  EXPECT_EQ(color(0xffff, "R03").encoding.transfer, (Transfer{Transfer::Curve::gamma, 2.19921875}));
  EXPECT_FALSE(color(0xffff, "").encoding.transfer);
  EXPECT_EQ(color(0xffff, "").source, "EXIF says uncalibrated, no profile");
  writeBytes(folder / "a.jpg", grayJpeg(""));
  EXPECT_FALSE(readPictureHeader(folder / "a.jpg").color);
}

TEST_F(ImageFile, ColoursThatAreNoRgbAreRefusedByName) {
  const auto complaint = [&](uint32_t photometric, uint32_t channels) {
    writeBytes(folder / "a.tif",
               tiffFile({.channels = channels, .photometric = photometric, .pixels = "1234"}));
    return errorOf([&] { readPictureSize(folder / "a.tif"); });
  };
  EXPECT_NE(complaint(5, 4).find("a.tif: cannot read (found colours of CMYK, expected RGB or gray"),
            std::string::npos);
  EXPECT_NE(complaint(8, 3).find("a.tif: cannot read (found colours of CIELAB, expected RGB or gray"),
            std::string::npos);
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
  EXPECT_NE(errorOf([&] { readPicture(folder / "a.hdr"); }).find("size: found 33333333, expected 1 to 65536"),
            std::string::npos);
}

TEST_F(ImageFile, PicturesThatEndEarlyAreRefusedThoughTheirReadersFillThemUp) {
  using namespace std::string_literals;
  const auto complaint = [&](const std::string& name, const std::string& bytes) {
    writeBytes(folder / name, bytes);
    return errorOf([&] { readPicture(folder / name); });
  };
  const auto isRefused = [](const std::string& line) { return line.find(": cannot read (") != line.npos; };
  const std::string jpeg = grayJpeg(""), pixels = jpeg.substr(0, jpeg.size() - 4);
  for (const size_t cut : {1u, 2u, 3u, 4u})
    EXPECT_TRUE(isRefused(complaint("a.jpg", jpeg.substr(0, jpeg.size() - cut)))) << cut;
  EXPECT_TRUE(isRefused(complaint("a.jpg", pixels + std::string(300, '\0'))));
  std::string tiff = tiffFile({.width = 4, .height = 4, .pixels = std::string(48, 'x')});
  const std::string place =
      littleEndianBytes(273, 2) + littleEndianBytes(4, 2) + littleEndianBytes(1); // of pixels
  tiff.replace(tiff.find(place) + place.size(), 4,
               littleEndianBytes(static_cast<uint32_t>(tiff.size() - 20)));
  EXPECT_TRUE(isRefused(complaint("a.tif", tiff)));
  EXPECT_NE(complaint("a.ppm", "P6\n2 2\n255\n123").find("cannot read (the file ends before its picture)"),
            std::string::npos);
  // Bytes that cameras write between the last pixel and the end.
  writeBytes(folder / "b.jpg", jpeg.substr(0, jpeg.size() - 2) + "\0\0\0"s + jpeg.substr(jpeg.size() - 2));
  EXPECT_FLOAT_EQ(readPicture(folder / "b.jpg").image.at(13, 4)[0], 192.f / 255);
}

TEST_F(ImageFile, DecodingTellsDamageInAnyLayer) {
  const Image image = randomImage(40, 30, 3, 0, 1, 1);
  const ExrLayer layers[] = {{{"a.R", "a.G", "a.B"}, &image}, {{"b.R", "b.G", "b.B"}, &image}};
  writeExr(folder / "a.exr", layers);
  EXPECT_NO_THROW(decodePicture(folder / "a.exr"));
  std::string bytes = readFile(folder / "a.exr");
  bytes.replace(bytes.size() - 400, 300, std::string(300, '\0'));
  writeBytes(folder / "a.exr", bytes);
  EXPECT_NE(errorOf([&] { decodePicture(folder / "a.exr"); }).find("a.exr: cannot read ("),
            std::string::npos);
}

TEST_F(ImageFile, WhatIsNoPngIsCalledWhatItIs) {
  writeBytes(folder / "a.png", grayJpeg(""));
  EXPECT_NE(
      errorOf([&] { readPictureHeader(folder / "a.png"); }).find("cannot read (not a PNG file, but JPEG)"),
      std::string::npos);
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
} // namespace surflect::image
