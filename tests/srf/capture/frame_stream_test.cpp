#include "srf/capture/frame_stream.h"

#include "tests/srf/image/files.h"

#include <nlohmann/json.hpp>

#include <optional>

namespace surflect::capture {
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
