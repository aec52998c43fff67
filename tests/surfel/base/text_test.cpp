#include "surfel/base/text.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

namespace surflect {

namespace {

std::string randomWord(std::mt19937_64& random) {
  std::string word(random() % 8, ' ');
  for (char& c : word) c = static_cast<char>('a' + random() % 3);
  return word;
}

TEST(EditDistance, IsAMetric) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    const auto a = randomWord(random), b = randomWord(random), c = randomWord(random);
    EXPECT_EQ(editDistance(a, a), 0u);
    EXPECT_EQ(editDistance(a, b), editDistance(b, a));
    EXPECT_EQ(editDistance(a, b) == 0, a == b);
    EXPECT_LE(editDistance(a, c), editDistance(a, b) + editDistance(b, c));
  }
}

TEST(EditDistance, CountsInsertionsDeletionsAndReplacements) {
  EXPECT_EQ(editDistance("", "warp"), 4u);
  EXPECT_EQ(editDistance("angel_deg", "angle_deg"), 2u);
  EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
}

TEST(NearestName, FindsTheOneThatWasMeant) {
  constexpr std::array<std::string_view, 3> known = {"position", "intensity", "color"};
  EXPECT_EQ(nearestName("colour", known), "color");
  EXPECT_EQ(nearestName("postion", known), "position");
  EXPECT_EQ(nearestName("fov", std::array<std::string_view, 2>{"from", "fov_deg"}), "fov_deg"); // was begun
}

} // namespace

namespace {

TEST(Base64, TestVectorsOfTheStandard) { // RFC 4648, §10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, BytesAreUnsigned) { EXPECT_EQ(base64("\xfb\xff\xfe"), "+//+"); }

} // namespace

} // namespace surflect
