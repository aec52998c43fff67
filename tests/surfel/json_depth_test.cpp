#include "surfel/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace surflect {
namespace {

TEST(JsonDepth, CountsListsAndObjectsThatHoldOneAnother) {
  EXPECT_EQ(jsonDepth("1"), 0);
  EXPECT_EQ(jsonDepth("[]"), 1);
  EXPECT_EQ(jsonDepth("[[], {}, []]"), 2);
  EXPECT_EQ(jsonDepth(R"({"a": [{"b": 1}], "c": [2]})"), 3);
}

TEST(JsonDepth, TakesNoNoticeOfWhatStringsHold) {
  EXPECT_EQ(jsonDepth(R"(["[[[{"])"), 1);
  EXPECT_EQ(jsonDepth(R"(["\"[[", []])"), 2);
  EXPECT_EQ(jsonDepth(R"(["\\", [[]]])"), 3);
}

TEST(JsonDepth, EndsWhereTheTextEnds) {
  EXPECT_EQ(jsonDepth(""), 0);
  EXPECT_EQ(jsonDepth("]}]["), 0);
  EXPECT_EQ(jsonDepth("\"\\"), 0);
  EXPECT_EQ(jsonDepth(std::string(1000000, '[')), 1000000);
}

} // namespace
} // namespace surflect
