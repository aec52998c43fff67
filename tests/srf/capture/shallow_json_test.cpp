#include "srf/capture/shallow_json.h"

#include <gtest/gtest.h>

#include <string>

namespace surflect::capture {
namespace {

TEST(ShallowJson, EndsBeforeWhatIsTooDeep) {
  EXPECT_EQ(shallowPart("[1, [2], {}]", 1), "[1, ");
  EXPECT_EQ(shallowPart(R"({"a": [{"b": 1}], "c": [2]})", 2), R"({"a": [)");
  EXPECT_EQ(shallowPart("[[]]", 0), "");
  EXPECT_EQ(shallowPart(std::string(1000000, '['), 64), std::string(64, '['));
}

TEST(ShallowJson, IsAllWhereNothingIs) {
  for (const char* json : {"", "1", "[]", "[[], {}, [], []]", "]]][[", "\"", "\"\\", "[\"\\"})
    EXPECT_EQ(shallowPart(json, 2), json);
}

TEST(ShallowJson, TakesNoNoticeOfWhatStringsHold) {
  EXPECT_EQ(shallowPart(R"(["[[[{", [], []])", 2), R"(["[[[{", [], []])");
  EXPECT_EQ(shallowPart(R"(["\"[[", []])", 1), R"(["\"[[", )");
  EXPECT_EQ(shallowPart(R"(["\\", []])", 1), R"(["\\", )");
}

} // namespace
} // namespace surflect::capture
