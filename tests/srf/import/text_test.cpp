#include "srf/import/text.h"

#include "tests/srf/image/files.h"

namespace surflect::importers {
namespace {

TEST(ImportText, LinesKeepTheirNumbersAndLoseTheirEnds) {
  const auto lines = linesOf("\xef\xbb\xbf  a b \r\n\n#c\nd");
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0].text, "a b");
  EXPECT_EQ(lines[1].text, "");
  EXPECT_EQ(lines[3].number, 4u);
  EXPECT_EQ(linesOf("a\rb\r")[1].text, "b"); // of classic Mac OS
  EXPECT_EQ(linesOf("a\rb\n").size(), 1u);
  const auto saying = sayingLinesOf("\n# no\n x \n");
  ASSERT_EQ(saying.size(), 1u);
  EXPECT_EQ(saying[0].text, "x");
  EXPECT_EQ(saying[0].number, 3u);
}

TEST(ImportText, WordsAreWhatStandsBetweenSeparators) {
  EXPECT_EQ(wordsOf(" a\tbc  d "), (std::vector<std::string_view>{"a", "bc", "d"}));
  EXPECT_EQ(wordsOf("a, b,c", ","), (std::vector<std::string_view>{"a", "b", "c"}));
  EXPECT_TRUE(wordsOf("  ").empty());
}

TEST(ImportText, NumbersComeBackToTheLastBit) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 1000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    char text[40];
    std::snprintf(text, sizeof text, i % 2 ? "%.17g" : "%+.17g", value);
    EXPECT_EQ(numberOf(text), value) << text;
  }
}

TEST(ImportText, WhatIsNoFiniteNumberIsRefused) {
  for (const char* word : {"", "x", "1x", "1,5", "nan", "inf", "-inf", "1e999", "0x10", "--1", "+-1", "1 "})
    EXPECT_NE(image::errorOf([&] { numberOf(word); }).find("expected a number"), std::string::npos) << word;
  for (const char* word : {"", "-1", "1.0", "4294967296", "1e3", "+1"})
    EXPECT_NE(image::errorOf([&] { countOf(word); }).find("expected a whole number"), std::string::npos)
        << word;
  EXPECT_EQ(countOf("4294967295"), 4294967295u);
}

TEST(ImportText, RawFilesOfDevelopedPicturesAreLeftOut) {
  image::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "below");
  for (const char* name :
       {"IMG_1.CR2", "IMG_1.JPG", "IMG_2.CR2", "IMG_3.jpg", "below/IMG_2.jpg", "below/IMG_3.nef"})
    image::writeBytes(folder / name, "");
  const std::vector<std::filesystem::path> here{folder / "IMG_1.JPG", folder / "IMG_2.CR2",
                                                folder / "IMG_3.jpg"};
  EXPECT_EQ(picturesIn(folder.path()), here);
  EXPECT_EQ(picturesBelow(folder.path()).size(), 5u);
}

TEST(ImportText, WhatIsShownIsOneShortLine) {
  EXPECT_EQ(shownText("a\nb\x01"), "\"a?b?\"");
  EXPECT_EQ(shownText(std::string(100, 'x')).size(), 65u);
}

} // namespace
} // namespace surflect::importers
