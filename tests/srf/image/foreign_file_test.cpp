#include "srf/image/foreign_file.h"

#include "srf/image/icc.h"
#include "tests/srf/image/files.h"
#include "tests/srf/image/foreign_files.h"
#include "tests/support/color_files.h"

namespace surflect::image {

namespace {

constexpr size_t kColorSpace = 70, kEndpoints = 74, kGamma = 110, kProfile = 126; // places in the file

std::string calibratedBmp(const Primaries& primaries, double gamma, double blueGamma) {
  std::string file = bmpFile(108, "\x10\x20\x30\xff");
  file.replace(kColorSpace, 4, littleEndianBytes(0));
  const Mat3<double> xyz = xyzFromRgb(primaries);
  for (int i = 0; i < 9; ++i) // red, green and blue: X, Y and Z of 2.30 bits
    file.replace(kEndpoints + 4 * static_cast<size_t>(i), 4,
                 littleEndianBytes(static_cast<uint32_t>(std::lround(xyz(i % 3, i / 3) * 1073741824))));
  for (size_t c = 0; c < 3; ++c)
    file.replace(kGamma + 4 * c, 4,
                 littleEndianBytes(static_cast<uint32_t>(65536 * (c == 2 ? blueGamma : gamma))));
  return file;
}

TEST(BmpHeader, EndpointsAndGammasAreAnEncoding) {
  const auto color = bmpHeader(calibratedBmp(kAdobeRgb, 2.5, 2.5)).color;
  ASSERT_TRUE(color);
  EXPECT_EQ(color->source, "BMP endpoints");
  EXPECT_EQ(color->problem, "");
  EXPECT_EQ(color->encoding.transfer, (Transfer{Transfer::Curve::gamma, 2.5}));
  const Primaries& read = *color->encoding.primaries;
  for (const auto& [got, expected] : {std::pair{read.red, kAdobeRgb.red},
                                      {read.green, kAdobeRgb.green},
                                      {read.blue, kAdobeRgb.blue},
                                      {read.white, kAdobeRgb.white}}) {
    EXPECT_NEAR(got.x, expected.x, 1e-8);
    EXPECT_NEAR(got.y, expected.y, 1e-8);
  }
  EXPECT_EQ(bmpHeader(calibratedBmp(kAdobeRgb, 2.5, 2)).color->problem,
            "gamma: found 00028000, 00028000, 00020000, expected one from 0.1 to 10");
}

TEST(BmpHeader, EndpointsOfZeroSayNothing) {
  std::string file = calibratedBmp(kAdobeRgb, 2.5, 2.5);
  file.replace(kEndpoints, 48, std::string(48, '\0'));
  EXPECT_FALSE(bmpHeader(file).color);
  EXPECT_FALSE(bmpHeader(bmpFile(108, "\x10\x20\x30\xff")).color); // which says sRGB, the usual
}

TEST(BmpHeader, AnEmbeddedProfileIsReadAndALinkedOneIsAProblem) {
  const std::string pixels = "\x10\x20\x30\xff", profile = profileBytes(kDisplayP3, ProfileCurve::srgb);
  std::string file = bmpFile(124, pixels) + profile;
  file.replace(kColorSpace, 4, "DEBM");
  file.replace(kProfile, 8,
               littleEndianBytes(static_cast<uint32_t>(124 + pixels.size())) +
                   littleEndianBytes(static_cast<uint32_t>(profile.size())));
  const auto color = bmpHeader(file).color;
  ASSERT_TRUE(color);
  EXPECT_EQ(color->source, "BMP ICC profile");
  EXPECT_EQ(color->problem, "");
  EXPECT_EQ(color->encoding.profile->name(), "made by a test");
  for (size_t length = 0; length < file.size(); ++length) {
    const auto cut = bmpHeader(file.substr(0, length)).color;
    EXPECT_TRUE(!cut || cut->problem == "the profile leaves the file") << length;
  }
  file.replace(kColorSpace, 4, "KNIL");
  EXPECT_EQ(bmpHeader(file).color->problem, "the profile is in another file");
}

} // namespace

namespace {

const Transfer kAdobeCurve{Transfer::Curve::gamma, 2.19921875};

TEST(ForeignColor, ExifSaysTheSameInEitherOrderOfBytes) {
  for (const char* order : {"II", "MM"}) {
    const auto color = [&](uint32_t space, const std::string& index) {
      return exifColorStatement(grayJpeg(exifSegment(space, index, order)));
    };
    ASSERT_TRUE(color(1, "R98"));
    EXPECT_EQ(color(1, "R98")->encoding.transfer, Transfer{Transfer::Curve::srgb}) << order;
    EXPECT_EQ(color(1, "R98")->encoding.primaries, kRec709);
    for (const auto& adobe : {color(2, ""), color(0xffff, "R03")}) { // 2 is not EXIF's, but written
      ASSERT_TRUE(adobe);
      EXPECT_EQ(adobe->source, "EXIF, Adobe RGB");
      EXPECT_EQ(adobe->encoding.transfer, kAdobeCurve);
      EXPECT_EQ(adobe->encoding.primaries, kAdobeRgb);
    }
    EXPECT_EQ(color(0xffff, "")->source, "EXIF says uncalibrated, no profile");
    EXPECT_FALSE(color(0xffff, "")->encoding.transfer || color(0xffff, "")->encoding.primaries);
    EXPECT_FALSE(color(7, ""));
  }
}

TEST(ForeignColor, ACutExifSaysTheSameOrNothing) {
  const std::string file = grayJpeg(exifSegment(1, "R98", "MM"));
  for (size_t length = 0; length < file.size(); ++length) {
    const auto color = exifColorStatement(std::string_view(file).substr(0, length));
    EXPECT_TRUE(!color || color->encoding.transfer == Transfer{Transfer::Curve::srgb}) << length;
  }
}

TEST(ForeignColor, TheProfileOfAWebpIsItsChunk) {
  const auto chunk = [](const std::string& name, const std::string& content) {
    return name + littleEndianBytes(static_cast<uint32_t>(content.size())) + content +
           std::string(content.size() % 2, '\0'); // chunks begin at even places
  };
  const auto file = [](const std::string& chunks) {
    return "RIFF" + littleEndianBytes(static_cast<uint32_t>(chunks.size()) + 4) + "WEBP" + chunks;
  };
  const std::string whole = file(chunk("VP8X", "odd") + chunk("ICCP", "profile") + chunk("VP8 ", "pixels"));
  EXPECT_EQ(webpProfile(whole), "profile");
  EXPECT_EQ(webpProfile(file(chunk("VP8 ", "pixels"))), "");
  EXPECT_EQ(webpProfile("no RIFF"), "");
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_TRUE(std::string("profile").starts_with(webpProfile(std::string_view(whole).substr(0, length))));
}

TEST(ForeignDamage, AJpegReachesItsEndMarkerAfterItsPixels) {
  using namespace std::string_literals;
  const std::string thumbnail =
      jpegSegment('\xe1', "Exif\0\0"s + grayJpeg("")); // has an end marker of its own
  for (const std::string& segments : {""s, thumbnail, "\xff"s + jpegSegment('\xfe', "filled before")}) {
    const std::string whole = grayJpeg(segments);
    EXPECT_EQ(jpegDamage(whole), "");
    EXPECT_EQ(jpegDamage(whole + "a trailer"), "");
    for (size_t size = 2; size < whole.size(); ++size)
      EXPECT_NE(jpegDamage(whole.substr(0, size)), "") << size;
    EXPECT_NE(jpegDamage(whole.substr(0, whole.size() - 4) + std::string(100, '\0')), "");
  }
  EXPECT_EQ(jpegDamage("no JPEG"), "");
}

TEST(ForeignDamage, PixelsOfAWebpAreNeverZerosForLong) {
  const auto file = [](const std::string& name, const std::string& content) {
    const std::string chunk = name + littleEndianBytes(static_cast<uint32_t>(content.size())) + content;
    return "RIFF" + littleEndianBytes(static_cast<uint32_t>(4 + chunk.size())) + "WEBP" + chunk;
  };
  const std::string coded(50, 'x');
  for (const char* name : {"VP8 ", "VP8L"}) {
    EXPECT_EQ(webpDamage(file(name, coded + std::string(63, '\0') + coded)), "");
    EXPECT_EQ(webpDamage(file(name, coded + std::string(64, '\0'))), "its pixels are zeros from byte 70 on");
  }
  EXPECT_EQ(webpDamage(file("XMP ", std::string(100, '\0'))), "");
}

} // namespace

} // namespace surflect::image
