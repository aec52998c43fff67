#include "render/scene/script_edit.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <bit>
#include <cmath>
#include <filesystem>
#include <random>

namespace surflect::scene {
namespace {

using Json = nlohmann::json;

const std::filesystem::path kShotPath = "shot.toml";

constexpr const char* kShotText = R"(# A shot of é
model = "vase.srf" # packed
[frames]
first = 1
last = 48

# The camera's way
[camera]
fov_deg = 30.0   # degrees
[camera.orbit]
radius = 4
azimuth_deg = [[1, 0], # begin
               [48, 90, "smooth"]]

# key
[[light]]
type = "point"
position = [1, "2*s", 3] # é moves
intensity = 40

# fill
[[light]]
type = "directional"
direction = [0, 0, 1]

[[warp]]
type = "handles"
handle = [{ rest = [0, 0, 1], to = [0, 0, 2] }, # top
          { rest = [0, 0, 0], to = [0, 0, 0] }]
)";

Json valuesOf(const std::string& text) { return Json::parse(scriptValues(text, kShotPath)); }
std::string edited(const std::string& text, const Json& values) {
  return withValues(text, kShotPath, values.dump());
}
// The text with one piece replaced, which it has once.
std::string withPiece(std::string text, const std::string& piece, const std::string& by) {
  const size_t at = text.find(piece);
  EXPECT_NE(at, text.npos);
  EXPECT_EQ(text.find(piece, at + 1), text.npos);
  return text.replace(at, piece.size(), by);
}
std::string editError(const std::string& text, const Json& values) {
  try {
    edited(text, values);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(ScriptEdit, EqualValuesLeaveTheTextAsItIs) {
  EXPECT_EQ(edited(kShotText, valuesOf(kShotText)), kShotText);
}

TEST(ScriptEdit, TablesOfLightsAndWarpsHaveTheirPlaces) {
  const Json values = valuesOf(kShotText);
  EXPECT_EQ(values["light"][1]["#"], 1);
  EXPECT_EQ(values["warp"][0]["#"], 0);
  EXPECT_EQ(values["camera"]["orbit"]["azimuth_deg"], Json::parse(R"([[1, 0], [48, 90, "smooth"]])"));
}

TEST(ScriptEdit, AValueIsReplacedWhereItStands) {
  Json values = valuesOf(kShotText);
  values["camera"]["fov_deg"] = 28.25;
  EXPECT_EQ(edited(kShotText, values), withPiece(kShotText, "30.0   #", "28.25   #"));
  values = valuesOf(kShotText);
  values["light"][0]["position"][2] = "3 + s";
  EXPECT_EQ(edited(kShotText, values), withPiece(kShotText, "\"2*s\", 3]", "\"2*s\", \"3 + s\"]"));
  values = valuesOf(kShotText);
  values["camera"]["orbit"]["azimuth_deg"][0][1] = -45;
  EXPECT_EQ(edited(kShotText, values), withPiece(kShotText, "[1, 0], # begin", "[1, -45], # begin"));
  values = valuesOf(kShotText);
  values["warp"][0]["handle"][1]["to"] = {0.1, 0.2, 0.3};
  EXPECT_EQ(edited(kShotText, values), withPiece(kShotText, "to = [0, 0, 0]", "to = [0.1, 0.2, 0.3]"));
}

TEST(ScriptEdit, ATrackTakesOtherForms) {
  Json values = valuesOf(kShotText);
  values["light"][0]["intensity"] = Json::parse("[[1, 40], [24, 0]]");
  values["camera"]["orbit"]["azimuth_deg"] = "90*s";
  const std::string text = edited(kShotText, values);
  EXPECT_NE(text.find("intensity = [[1, 40], [24, 0]]\n"), text.npos) << text;
  EXPECT_NE(text.find("azimuth_deg = \"90*s\"\n"), text.npos) << text;
}

TEST(ScriptEdit, KeysComeAndGo) {
  Json values = valuesOf(kShotText);
  values["light"][1]["color"] = {1, 0.5, 0.25};
  values["light"][0].erase("intensity");
  values["frames"]["fps"] = 25;
  values["coordinates"] = "model";
  const std::string text = edited(kShotText, values);
  EXPECT_EQ(text, withPiece(withPiece(withPiece(withPiece(kShotText, "direction = [0, 0, 1]\n",
                                                          "direction = [0, 0, 1]\ncolor = [1, 0.5, 0.25]\n"),
                                                "intensity = 40\n", ""),
                                      "last = 48\n", "last = 48\nfps = 25\n"),
                            "# packed\n", "# packed\ncoordinates = \"model\"\n"));
}

TEST(ScriptEdit, ACameraTakesAnotherForm) {
  Json values = valuesOf(kShotText);
  values["camera"] = {{"position", {4, 0, 1}}, {"look_at", {0, 0, 0}}, {"fov_deg", 30}};
  const std::string text = edited(kShotText, values);
  EXPECT_EQ(text.find("orbit"), text.npos) << text;
  EXPECT_NE(text.find("fov_deg = 30.0   # degrees\n"), text.npos) << text;
  EXPECT_NE(text.find("# key\n[[light]]"), text.npos) << text;
}

TEST(ScriptEdit, BlurAndGroundStayBesideOtherValues) {
  const std::string text =
      withPiece(kShotText, "fov_deg = 30.0 ", "shutter_deg = 180 # film\nfov_deg = 30.0 ") +
      "[ground]\npoint = [0, 0, -1] # floor\n";
  Json values = valuesOf(text);
  EXPECT_EQ(values["camera"]["shutter_deg"], 180);
  values["light"][0]["intensity"] = 41;
  values["ground"]["shadow"] = 0.5;
  EXPECT_EQ(edited(text, values), withPiece(withPiece(text, "intensity = 40", "intensity = 41"), "# floor\n",
                                            "# floor\nshadow = 0.5\n"));
}

TEST(ScriptEdit, LightsComeAndGo) {
  Json values = valuesOf(kShotText);
  values["light"].erase(0);
  values["light"].push_back({{"type", "environment"}, {"image", "a \"b\".exr"}, {"rotate_deg", "30*t"}});
  const std::string text = edited(kShotText, values);
  EXPECT_EQ(text.find("moves"), text.npos) << text;
  EXPECT_NE(text.find("# fill\n[[light]]\ntype = \"directional\""), text.npos) << text;
  EXPECT_TRUE(text.ends_with(
      "\n[[light]]\ntype = \"environment\"\nimage = \"a \\\"b\\\".exr\"\nrotate_deg = \"30*t\"\n"))
      << text;
  EXPECT_EQ(text.find("# key"), text.npos) << text;
  EXPECT_EQ(valuesOf(text)["light"].size(), 2u);
}

TEST(ScriptEdit, NewTablesStandWhereTheyAreAskedFor) {
  Json values = valuesOf(kShotText);
  values["light"].insert(values["light"].begin() + 1, Json{{"type", "point"}, {"intensity", 7}});
  EXPECT_EQ(edited(kShotText, values),
            withPiece(kShotText, "# fill\n", "[[light]]\ntype = \"point\"\nintensity = 7\n\n# fill\n"));
}

TEST(ScriptEdit, TheLastTableOfAListMayGo) {
  for (const bool isEmpty : {false, true}) {
    Json values = valuesOf(kShotText);
    values["warp"] = Json::array();
    if (!isEmpty) values.erase("warp");
    const std::string text = edited(kShotText, values);
    EXPECT_EQ(text.find("warp"), text.npos) << text;
    EXPECT_EQ(edited(text, values), text);
    values["warp"] = {{{"type", "rigid"}}};
    EXPECT_TRUE(edited(text, values).ends_with("\n[[warp]]\ntype = \"rigid\"\n"));
  }
}

TEST(ScriptEdit, InlineTablesAndDottedKeysAreEdited) {
  const std::string text =
      "camera.fov_deg = 30 # f\ncamera.orbit = { radius = 4, azimuth_deg = 10 }\nlight = []";
  Json values = valuesOf(text);
  values["camera"]["orbit"] = {{"azimuth_deg", 20}, {"elevation_deg", 5}};
  values["camera"]["up"] = {0, 0, 1};
  values["light"] = Json::array({{{"type", "point"}}});
  const std::string result = edited(text, values);
  EXPECT_NE(result.find("camera.fov_deg = 30 # f\n"), text.npos) << result;
  Json plain = valuesOf(result);
  EXPECT_EQ(plain["camera"], values["camera"]) << result;
  EXPECT_EQ(plain["light"][0]["type"], "point") << result;
}

// Changes, removes and adds a few values anywhere below `value`.
void shake(Json& value, std::mt19937& random) {
  const auto chance = [&](int one) { return std::uniform_int_distribution<int>(1, one)(random) == 1; };
  std::uniform_real_distribution<double> number(-10, 10);
  if (value.is_object()) {
    for (auto element = value.begin(); element != value.end();) {
      if (element.key() != "#" && element.key() != "light" && element.key() != "warp" &&
          !element->is_object() && chance(12)) {
        element = value.erase(element);
      } else {
        if (element.key() != "#") shake(*element, random);
        ++element;
      }
    }
    if (chance(4)) value["new key"] = {number(random), "x"};
  } else if (value.is_array()) {
    for (Json& element : value) shake(element, random);
    if (!value.empty() && value[0].is_object() && value[0].contains("#") && chance(3)) {
      value.erase(0);
      value.push_back({{"type", "point"}, {"intensity", number(random)}});
    }
  } else if (chance(5)) {
    value = chance(2) ? Json(number(random)) : Json("text \\ \"é\" \n");
  }
}

TEST(ScriptEdit, TheTextThenHasTheValues) {
  std::mt19937 random(1);
  for (int round = 0; round < 1000; ++round) {
    Json values = valuesOf(kShotText);
    shake(values, random);
    const std::string text = edited(kShotText, values); // throws unless the text has the values
    EXPECT_NE(text.find("# A shot of é\n"), text.npos);
    EXPECT_EQ(edited(text, valuesOf(text)), text);
  }
}

TEST(ScriptEdit, NumbersKeepTheirBits) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 1000; ++round) {
    const double number = std::bit_cast<double>(random());
    if (!std::isfinite(number)) continue;
    const double again = valuesOf(edited("x = 0", {{"x", number}}))["x"].get<double>();
    EXPECT_EQ(std::bit_cast<uint64_t>(again), std::bit_cast<uint64_t>(number));
  }
}

TEST(ScriptEdit, RefusesWhatIsNoScript) {
  Json values = valuesOf(kShotText);
  values["light"][0]["#"] = 7;
  EXPECT_NE(editError(kShotText, values).find("shot.toml: light.#: found 7"), std::string::npos);
  values = valuesOf(kShotText);
  std::swap(values["light"][0], values["light"][1]);
  EXPECT_NE(editError(kShotText, values).find("rising places"), std::string::npos);
  values = valuesOf(kShotText);
  values["frames"]["fps"] = nullptr;
  EXPECT_NE(editError(kShotText, values).find("frames.fps: found null"), std::string::npos);
  EXPECT_NE(editError(kShotText, 3).find("a JSON object"), std::string::npos);
  EXPECT_THROW(withValues(kShotText, kShotPath, "{"), Error);
  EXPECT_THROW(withValues(kShotText, kShotPath, std::string(100'000, '[')), Error);
  EXPECT_THROW(withValues("x = ", kShotPath, "{}"), Error);
}

} // namespace
} // namespace surflect::scene
