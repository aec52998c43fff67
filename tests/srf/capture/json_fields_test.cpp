#include "srf/capture/json_fields.h"

#include "tests/srf/image/files.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <optional>
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

namespace {

// The document put together again; empty if it cannot be streamed.
std::optional<Json> streamed(std::string_view text) {
  Json whole, frames = Json::array();
  const auto begin = [&](const Json& root) {
    EXPECT_TRUE(frames.empty());
    whole = root;
  };
  if (!streamFrames(text, begin, [&](const Json& frame) { frames.push_back(frame); })) return std::nullopt;
  EXPECT_EQ(whole["frames"], Json::array());
  whole["frames"] = frames;
  return whole;
}

TEST(FrameStream, RootAndFramesAreThoseOfTheWholeTree) {
  for (
      const std::string text :
      {R"({"frames": [{}]})",
       R"({"w": 3, "h": -1, "k1": 0.25, "n": null, "frames": [{"a": [1, [2, {}]]}, {}]})",
       R"({"lights": [{"name": "a\n\u00e4", "frames": [1, 2]}, [], [[true]]], "frames": [{"b": {"frames": [{}]}}]})",
       R"({"a": 1, "a": {"b": 2, "b": [3]}, "frames": [{"c": 1e3, "c": false}]})"})
    EXPECT_EQ(streamed(text), parseJson(text)) << text;
}

TEST(FrameStream, WhateverMayMeanAnotherThingIsLeftToTheWholeTree) {
  for (const std::string text :
       {"", "3", "[]", R"([{"frames": [{}]}])", "{}", R"({"w": 3})", R"({"frames": []})",
        R"({"frames": null})", R"({"frames": {"a": {}}})", R"({"frames": [1]})", R"({"frames": [{}, []]})",
        R"({"frames": [{}], "w": 3})", R"({"frames": [{}], "frames": [{}]})", R"({"frames": [{}]}})",
        R"({"frames": [{}],})", R"({"frames": [{},]})", R"({"frames": [{}])",
        R"({"w": 1e999, "frames": [{}]})", R"({"frames": [{"a": 1e999}]})"})
    EXPECT_EQ(streamed(text), std::nullopt) << text;
  const std::string deep(100, '['), shallow(100, ']');
  EXPECT_EQ(streamed(R"({"frames": [{"a": )" + deep + shallow + "}]}"), std::nullopt);
}

TEST(FrameStream, EveryTruncationIsLeftToTheWholeTree) {
  const std::string text = R"({"w": 3, "lights": [{"name": "a"}], "frames": [{"a": [1, 2]}, {"b": "c"}]})";
  for (size_t length = 0; length < text.size(); ++length)
    EXPECT_EQ(streamed(text.substr(0, length)), std::nullopt) << length;
  EXPECT_EQ(streamed(text), parseJson(text));
}

} // namespace

} // namespace surflect::capture
