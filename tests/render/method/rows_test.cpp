#include "render/method/rows.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace surflect::method {
namespace {

enum class Order { list, peel, bsp };

struct Look {
  bool shadows = true;
  int samples = 2;
  size_t cacheMb = 1024;
  double level = 0.5;
  float error = 0.25f;
  Order order = Order::peel;
  std::optional<bool> reciprocity;
  std::optional<int> pairs;
  std::optional<double> white;
  std::optional<Order> fallback;

  friend bool operator==(const Look&, const Look&) = default;
};

const Rows<Look>& rows() {
  const std::vector<Value> orders = words({"list", "peel", "bsp"});
  static const Rows<Look> kRows{
      row<Look>("shadows", [](auto& o) -> auto& { return o.shadows; }, {.help = "a switch"}),
      row<Look>("samples", [](auto& o) -> auto& { return o.samples; },
                {.domain = wholeRange(1, 8), .help = "an int"}),
      row<Look>("cache_mb", [](auto& o) -> auto& { return o.cacheMb; },
                {.domain = wholeRange(0, 1 << 24), .help = "a size"}),
      row<Look>("level", [](auto& o) -> auto& { return o.level; },
                {.domain = Range{0, 3}, .help = "a double"}),
      row<Look>("error", [](auto& o) -> auto& { return o.error; },
                {.domain = Range{0, 1}, .help = "a float"}),
      row<Look>("order", [](auto& o) -> auto& { return o.order; }, {.domain = orders, .help = "an enum"}),
      row<Look>("reciprocity", [](auto& o) -> auto& { return o.reciprocity; }, {.help = "perhaps a switch"}),
      row<Look>("pairs", [](auto& o) -> auto& { return o.pairs; },
                {.domain = wholeRange(1, 12), .help = "perhaps an int"}),
      row<Look>("white", [](auto& o) -> auto& { return o.white; },
                {.domain = Range{0, 9}, .help = "perhaps a double"}),
      row<Look>("fallback", [](auto& o) -> auto& { return o.fallback; },
                {.domain = orders, .help = "perhaps an enum"})};
  return kRows;
}

Look lookOf(const Setting& setting) {
  requireSetting({"look", optionsOf(rows())}, setting);
  return applied(Look{}, rows(), setting);
}

TEST(Rows, DefaultsAreThoseOfANewStruct) {
  const std::vector<Option> options = optionsOf(rows());
  const Setting defaults = withDefaults(options, {});
  EXPECT_EQ(defaults, (Setting{{"shadows", "on"},
                               {"samples", 2},
                               {"cache_mb", 1024},
                               {"level", 0.5},
                               {"error", 0.25},
                               {"order", "peel"}}))
      << "optional members have none";
  EXPECT_EQ(lookOf(defaults), Look{});
  EXPECT_EQ(lookOf({}), Look{});
}

TEST(Rows, SwitchesNeedNoDomain) {
  for (const Option& option : optionsOf(rows()))
    EXPECT_EQ(option.isSwitch(), option.name == "shadows" || option.name == "reciprocity") << option.name;
}

TEST(Rows, EveryKindOfMemberTakesItsValue) {
  const Look look = lookOf({{"shadows", "off"},
                            {"samples", 8},
                            {"cache_mb", 3},
                            {"level", 2.75},
                            {"error", 0.125},
                            {"order", "bsp"},
                            {"reciprocity", "off"},
                            {"pairs", 4},
                            {"white", 1.5},
                            {"fallback", "list"}});
  EXPECT_EQ(look, (Look{false, 8, 3, 2.75, 0.125f, Order::bsp, false, 4, 1.5, Order::list}));
  EXPECT_EQ(lookOf({{"reciprocity", "on"}}).reciprocity, true);
}

TEST(Rows, ValuesOfAMemberComeBackAsTheDefaultOfItsRow) {
  for (const Value& value : words({"list", "peel", "bsp"})) {
    const Option option{.name = "order", .domain = words({"list", "peel", "bsp"})};
    EXPECT_EQ(detail::valueOf(detail::memberOf<Order>(value, option), option), value);
  }
  for (const char* value : {kOn, kOff}) {
    const Option option{.name = "shadows", .domain = words({kOn, kOff})};
    EXPECT_EQ(detail::valueOf(detail::memberOf<bool>(value, option), option), Value(value));
  }
  for (const double value : {0.1, 1e-300, 3.0})
    EXPECT_EQ(detail::valueOf(detail::memberOf<double>(value, {}), {}), Value(value));
}

TEST(Rows, MembersThatASettingDoesNotNameStayAsTheyWere) {
  Look base;
  base.samples = 5;
  base.pairs = 7;
  const Look look = applied(base, rows(), {{"level", 1}});
  base.level = 1;
  EXPECT_EQ(look, base);
}

} // namespace
} // namespace surflect::method
