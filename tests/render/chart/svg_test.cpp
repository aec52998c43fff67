#include "render/chart/svg.h"

#include <cmath>

namespace surflect::chart {
namespace {

TEST(Svg, MarkupInTextIsEscaped) {
  EXPECT_EQ(escaped("<a href=\"x\" id='y'>&amp;"), "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;amp;");
  EXPECT_EQ(escaped(std::string_view("\0\x1b\n", 3)), "&#xFFFD;&#xFFFD;\n");
}

TEST(Svg, NumbersHaveTheDigitsThatAreAskedFor) {
  EXPECT_EQ(rounded(44, 3), "44.0");
  EXPECT_EQ(rounded(9.996, 3), "10.0");
  EXPECT_EQ(rounded(123456, 3), "123000");
  EXPECT_EQ(rounded(-0.001234, 2), "−0.0012");
  EXPECT_EQ(rounded(INFINITY, 3), "∞");
  EXPECT_EQ(rounded(0, 3), "0");
  EXPECT_EQ(shortest(44, 3), "44");
  EXPECT_EQ(shortest(0.0120, 3), "0.012");
  EXPECT_EQ(shortest(100, 3), "100");
}

TEST(Svg, AnAxisMapsEndsToEnds) {
  for (const bool isLogarithmic : {false, true}) {
    const Axis axis{isLogarithmic, 2, 50, 400, 10};
    EXPECT_DOUBLE_EQ(axis.position(2), 400);
    EXPECT_DOUBLE_EQ(axis.position(50), 10);
    EXPECT_NEAR(axis.position(isLogarithmic ? 10 : 26), 205, 1e-9);
  }
}

TEST(Svg, AnAxisHoldsItsFiniteValues) {
  for (const bool isLogarithmic : {false, true}) {
    const std::vector<std::vector<double>> sets{{}, {7}, {0, NAN, INFINITY, 3, 30}, {1e-9, 1e9}};
    for (const std::vector<double>& values : sets) {
      const Axis axis = axisAround(values, isLogarithmic, 0, 1);
      EXPECT_TRUE(std::isfinite(axis.high - axis.low) && axis.low < axis.high &&
                  (!isLogarithmic || axis.low > 0));
      for (const double value : values)
        if (std::isfinite(value) && (!isLogarithmic || value > 0)) {
          EXPECT_GT(axis.position(value), 0);
          EXPECT_LT(axis.position(value), 1);
        }
    }
  }
}

// Whether a number has at most three significant digits.
bool isRound(double tick) {
  if (tick == 0) return true;
  const double digits = std::abs(tick) / std::pow(10, std::floor(std::log10(std::abs(tick)) + 1e-9) - 2);
  return std::abs(digits - std::round(digits)) < 1e-9;
}

TEST(Svg, TicksAreRoundInsideRisingAndFew) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> exponent(-6, 6), span(0.05, 5);
  for (int trial = 0; trial < 400; ++trial) {
    const bool isLogarithmic = trial % 2 == 0;
    const double low = std::pow(10, exponent(random));
    const Axis axis{isLogarithmic, low, low * std::pow(10, span(random)), 0, 1};
    const size_t most = 2 + static_cast<size_t>(trial) % 8;
    const std::vector<double> found = ticks(axis, most);
    EXPECT_LE(found.size(), most);
    EXPECT_TRUE(std::ranges::is_sorted(found, std::less_equal()));
    for (const double tick : found)
      EXPECT_TRUE(tick >= axis.low && tick <= axis.high && isRound(tick)) << tick;
    EXPECT_GE(found.size(), most >= 5 ? 2u : 0u) << axis.low << " " << axis.high;
  }
}

TEST(Svg, TicksOfATypicalAxis) {
  EXPECT_EQ(ticks({true, 18, 95, 0, 1}, 8), (std::vector<double>{20, 30, 40, 50, 60, 70, 80, 90}));
  EXPECT_EQ(ticks({true, 0.015, 7, 0, 1}, 7), (std::vector<double>{0.03, 0.1, 0.3, 1, 3}));
  EXPECT_EQ(ticks({true, 1e-7, 2e3, 0, 1}, 4), (std::vector<double>{1e-6, 1e-3, 1, 1e3}));
  EXPECT_EQ(ticks({false, 37.9, 38.7, 0, 1}, 5), (std::vector<double>{38, 38.2, 38.4, 38.6}));
}

TEST(Svg, LabelsOfClosePlacesDoNotOverlap) {
  std::vector<Place> places;
  for (int i = 0; i < 6; ++i) places.push_back({200.0 + 5 * i, 100.0 + 3 * (i % 2)});
  const std::vector<std::array<double, 2>> sizes(places.size(), {60, 15});
  const Box bounds{0, 0, 500, 400};
  const std::vector<Box> boxes = placeLabels(places, sizes, places, bounds);
  ASSERT_EQ(boxes.size(), places.size());
  for (size_t i = 0; i < boxes.size(); ++i) {
    EXPECT_NEAR(overlap(boxes[i], bounds), 60 * 15, 1e-9);
    for (size_t k = 0; k < i; ++k) EXPECT_EQ(overlap(boxes[i], boxes[k]), 0) << i << " " << k;
  }
}

} // namespace
} // namespace surflect::chart
