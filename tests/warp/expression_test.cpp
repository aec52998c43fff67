#include "warp/expression.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <locale>
#include <numbers>
#include <random>

namespace surflect::warp {
namespace {

constexpr std::array<std::string_view, 2> xy = {"x", "y"};

double value(const std::string& text, double x = 0, double y = 0) {
  return Expression(text, xy)(std::array{x, y});
}

std::string complaint(const std::string& text) {
  try {
    Expression(text, xy);
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(Expression, EqualsTheSameFormulaInCpp) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-3, 3);
  const Expression formula("x + 0.1*sin(6*y + pi) - exp(y)/e^2 + (x > y ? 1 : -1)", xy);
  for (int i = 0; i < 1000; ++i) {
    const double x = uniform(random), y = uniform(random);
    const double expected = x + 0.1 * std::sin(6 * y + std::numbers::pi) -
                            std::exp(y) / (std::numbers::e * std::numbers::e) + (x > y ? 1 : -1);
    EXPECT_DOUBLE_EQ(formula(std::array{x, y}), expected);
  }
}

TEST(Expression, ManyThreadsGetTheAnswersOfOne) {
  const Expression formula("sin(x)*y + x^2", xy);
  std::vector<double> together(20000), alone(together.size());
  tbb::parallel_for(size_t{0}, together.size(), [&](size_t i) {
    together[i] = formula(std::array{static_cast<double>(i) * 1e-3, 2.0});
  });
  for (size_t i = 0; i < alone.size(); ++i)
    alone[i] = value("sin(x)*y + x^2", static_cast<double>(i) * 1e-3, 2);
  EXPECT_EQ(together, alone);
}

TEST(Expression, HasNoValueWhereMathematicsHasNone) {
  EXPECT_TRUE(std::isinf(value("1/x")));
  EXPECT_TRUE(std::isnan(value("sqrt(x - 1)")));
  EXPECT_TRUE(std::isnan(value("x/y")));
}

TEST(Expression, ComplaintsNameTheExpressionAndTheCharacter) {
  const auto startsWith = [](const std::string& text, const std::string& start) {
    return text.starts_with(start);
  };
  EXPECT_PRED2(startsWith, complaint("x + foo(1)"), "found \"x + foo(1)\", wrong at character 5 (");
  EXPECT_PRED2(startsWith, complaint("2*cos(x"), "found \"2*cos(x\", wrong at character 8 (");
  EXPECT_PRED2(startsWith, complaint("z"), "found \"z\", wrong at character 1 (");
}

TEST(Expression, RefusesWhatIsNoSingleValue) {
  for (const char* text : {"", " ", "1, 2", "\"text\"", "x y", "x?1:", "1e999", "\n", "x +\xff", "((((x"})
    EXPECT_THROW(Expression(text, xy), Error) << text;
  EXPECT_THROW(Expression(std::string(5000, '('), xy), Error);
  EXPECT_THROW(Expression(std::string("x\0", 2), xy), Error);
}

TEST(Expression, RefusesAssignmentButCompares) {
  EXPECT_THROW(Expression("x = 5", xy), Error);
  EXPECT_THROW(Expression("(x=y)", xy), Error);
  EXPECT_EQ(value("x == 2", 2), 1);
  EXPECT_EQ(value("(x <= 2) + (x >= 2) + (x != 2)", 2), 2);
}

struct DecimalComma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Expression, DecimalsUseThePointInEveryLocale) {
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new DecimalComma));
  const double read = value("1.5 + 1000.25");
  std::locale::global(before);
  EXPECT_EQ(read, 1001.75);
}

TEST(Expression, RandomTextIsAnErrorOrAnExpression) {
  const std::vector<std::string> words = {"x",    "y",    "1.5", "(", ")",  "+", "-",  "*",  "/",
                                          "^",    "sin(", ",",   "?", ":",  "<", "==", "&&", "||",
                                          "min(", "pi",   "!",   " ", "\"", ".", "e",  "if"};
  std::mt19937 random(2);
  int valid = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string text;
    for (size_t words_left = 1 + random() % 8; words_left > 0; --words_left)
      text += words[random() % words.size()];
    try {
      Expression(text, xy)(std::array{0.5, -2.0});
      ++valid;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(valid, 100); // so that both ways were tried
  EXPECT_LT(valid, 4000);
}

} // namespace
} // namespace surflect::warp
