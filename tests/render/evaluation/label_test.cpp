#include "render/evaluation/label.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>
#include <string>

namespace surflect::evaluation {
namespace {

image::Image drawnLabel(const std::string& text, int scale = 1) {
  image::Image image(static_cast<int>(text.size()) * scale * kLabelAdvance, scale * kLabelHeight, 3);
  drawLabel(image, 0, 0, text, {1, 1, 1}, scale);
  return image;
}

TEST(Label, EveryPrintableCharacterLooksDifferent) {
  std::set<std::vector<float>> glyphs;
  for (char c = ' '; c <= '~'; ++c) glyphs.insert(drawnLabel({c}).values);
  EXPECT_EQ(glyphs.size(), 95u);
  EXPECT_FALSE(glyphs.contains(drawnLabel("\n").values));
  EXPECT_EQ(drawnLabel("\x80").values, drawnLabel("\n").values);
}

TEST(Label, CharactersLeaveAColumnToTheirNeighbours) {
  for (char c = ' '; c <= '~'; ++c)
    for (int y = 0; y < kLabelHeight; ++y) EXPECT_EQ(drawnLabel({c}).at(kLabelAdvance - 1, y)[0], 0) << c;
}

TEST(Label, ATextIsItsCharactersSideBySide) {
  const image::Image text = drawnLabel("C07", 2), last = drawnLabel("7", 2);
  for (int y = 0; y < last.height; ++y)
    for (int x = 0; x < last.width; ++x) EXPECT_EQ(text.at(4 * kLabelAdvance + x, y)[0], last.at(x, y)[0]);
}

TEST(Label, PartsOffTheImageAreLeftOut) {
  const image::Image whole = drawnLabel("Ag", 3);
  image::Image cut(20, 11, 3);
  drawLabel(cut, -9, -7, "Ag", {1, 1, 1}, 3);
  for (int y = 0; y < cut.height; ++y)
    for (int x = 0; x < cut.width; ++x) EXPECT_EQ(cut.at(x, y)[0], whole.at(x + 9, y + 7)[0]);
}

} // namespace
} // namespace surflect::evaluation
