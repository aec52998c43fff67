#include "srf/image/foreign_color.h"

#include "tests/srf/image/files.h"
#include "tests/srf/image/foreign_files.h"

namespace surflect::image {
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

} // namespace
} // namespace surflect::image
