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

TEST(EditDistance, IsSymmetricAndZeroForEqualsAlone) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    const auto a = randomWord(random), b = randomWord(random);
    EXPECT_EQ(editDistance(a, a), 0u);
    EXPECT_EQ(editDistance(a, b), editDistance(b, a));
    EXPECT_EQ(editDistance(a, b) == 0, a == b);
    EXPECT_LE(editDistance(a, b), std::max(a.size(), b.size()));
  }
}

TEST(EditDistance, CountsInsertionsDeletionsReplacementsAndSwaps) {
  EXPECT_EQ(editDistance("", "warp"), 4u);
  EXPECT_EQ(editDistance("angel_deg", "angle_deg"), 1u);
  EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
}

TEST(NearestName, FindsTheOneThatWasMeant) {
  constexpr std::array<std::string_view, 3> known = {"position", "intensity", "color"};
  EXPECT_EQ(nearestName("colour", known), "color");
  EXPECT_EQ(nearestName("postion", known), "position");
  EXPECT_EQ(nearestName("fov", std::array<std::string_view, 2>{"from", "fov_deg"}), "fov_deg"); // was begun
  EXPECT_EQ(nearestName("COLOR", known), "color");
  EXPECT_EQ(nearestName("", std::span<const std::string_view>()), "");
}

TEST(NearestName, IsEmptyIfNoneIsNear) {
  constexpr std::array<std::string_view, 5> known = {"twist", "bend", "slf", "C12.png", "L120"};
  for (const char* const name : {"rotation", "ulr", "C13.png", "C1.png", "L12", "xy", ""})
    EXPECT_EQ(nearestName(name, known), "");
}

TEST(NearestName, IsFoundAfterOneSlipOfTheKeyboard) {
  constexpr std::array<std::string_view, 7> known = {"position",  "intensity", "color",  "render",
                                                     "direction", "surfels",   "fov_deg"};
  std::mt19937_64 random(2);
  for (int i = 0; i < 2000; ++i) {
    const std::string_view meant = known[random() % known.size()];
    const size_t at = random() % (meant.size() - 1);
    const char other = static_cast<char>('a' + random() % 26);
    std::string typed(meant);
    switch (random() % 4) {
    case 0:
      typed.erase(at, 1);
      break;
    case 1:
      typed.insert(at, 1, other);
      break;
    case 2:
      typed[at] = other;
      break;
    default:
      std::swap(typed[at], typed[at + 1]);
    }
    EXPECT_EQ(nearestName(typed, known), meant) << typed;
    EXPECT_EQ(didYouMean(typed, known), "; did you mean " + std::string(meant) + "?");
  }
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
