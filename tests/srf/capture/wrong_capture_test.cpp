// Captures that are wrong, damaged or hostile.
#include "tests/srf/capture/capture_file.h"

#include <string>

namespace surflect::capture {
namespace {

using testing::Json, testing::fieldOf;
using WrongCapture = testing::CaptureFile;

TEST_F(WrongCapture, PathsCannotLeaveTheFolder) {
  const std::string outside = folder.path().filename().string() + "-outside.png";
  for (const std::string& path :
       {"../" + outside, "images/../../" + outside, folder.path().string() + "-outside.png",
        folder.path().string() + "/images/a.png", std::string(".."), std::string(),
        std::string("images/a.png\0x", 14)})
    for (const char* field : {"/geometry", "/frames/0/file_path", "/frames/0/mask_path"}) {
      Json json = full();
      json[Json::json_pointer(field)] = path;
      EXPECT_NE(error(json).find("expected a path inside the capture's folder"), std::string::npos) << path;
    }
  Json json = full();
  json["frames"][0]["file_path"] = "images/../images/a.png"; // this one stays inside
  EXPECT_EQ(read(json).frames[0].picture, "images/a.png");
}

TEST_F(WrongCapture, LinksLeadOutOfTheFolderOnlyWhereThatIsAllowed) {
  const std::filesystem::path outside = folder.path().string() + "-outside.png";
  std::filesystem::create_symlink(outside, folder / "out.png");
  std::filesystem::create_directory_symlink(folder.path().parent_path(), folder / "up");
  std::filesystem::create_symlink("images/a.png", folder / "in.png");
  for (const std::string& path : {std::string("out.png"), "up/" + outside.filename().string()})
    for (const char* field : {"/geometry", "/frames/0/file_path", "/frames/0/mask_path"}) {
      Json json = full();
      json[Json::json_pointer(field)] = path;
      EXPECT_NE(error(json).find("found a link that leads out of it: " + path), std::string::npos);
    }
  Json json = full();
  json["frames"][0]["file_path"] = "in.png";
  EXPECT_EQ(read(json).frames[0].picture, "in.png");
  for (const std::string& path :
       {std::string("out.png"), outside.string(), "../" + outside.filename().string()}) {
    json["frames"][0]["file_path"] = path;
    EXPECT_EQ(parseCapture(json.dump(), folder / "transforms.json", PathRule::anywhere).frames[0].picture,
              path);
  }
}

TEST_F(WrongCapture, OfOneThatIsBeingMadeFilesNeedNotBeThereButStayInside) {
  Json json = full();
  const auto parsed = [&] { return parseCapture(json.dump(), folder / "transforms.json", PathRule::unmade); };
  for (const char* field : {"/geometry", "/frames/0/file_path", "/frames/0/mask_path"})
    json[Json::json_pointer(field)] = "later.png";
  EXPECT_EQ(parsed().frames[0].picture, "later.png");
  EXPECT_EQ(parsed().geometry, "later.png");
  EXPECT_NE(error(json).find("later.png"), std::string::npos);
  json["geometry"] = "../later.png";
  EXPECT_NE(image::errorOf(parsed).find("inside"), std::string::npos);
}

TEST_F(WrongCapture, DeepNestingIsRefusedNotFollowed) {
  for (const char* open : {"[", "{\"a\":"}) {
    std::string text = "{\"frames\": ";
    for (int i = 0; i < 1000000; ++i) text += open;
    EXPECT_NE(image::errorOf([&] { readText(text); }).find("nested too deeply"), std::string::npos);
  }
}

// Without any closing bracket, the first mistake is reported, not the apparent depth.
TEST_F(WrongCapture, AMistakeBeforeTheDepthIsToldFirst) {
  std::string text = "{\"frames\": [\n";
  for (int i = 0; i < 200; ++i) text += "{\"file_path\": \"a.png\",\n";
  EXPECT_NE(image::errorOf([&] { readText(text); }).find("malformed JSON in line 3"), std::string::npos);
}

TEST_F(WrongCapture, NamesWithLineFeedsStillMakeErrorsOfOneLine) {
  Json json = full();
  json["frames"][0]["file_path"] = "a\nb";
  EXPECT_NE(error(json).find("a?b"), std::string::npos);
}

TEST_F(WrongCapture, MissingFilesAreNamed) {
  Json json = full();
  json["frames"][1]["file_path"] = "images/c.exr";
  EXPECT_EQ(error(json),
            "frames[1].file_path: found none at images/c.exr, expected a picture (its extension may "
            "be left out)");
  json["frames"][1]["file_path"] = "Images/A.png";
  EXPECT_NE(
      error(json).find(
          "found none at Images/A.png (images/a.png is there: letter case or accents differ), expected"),
      std::string::npos)
      << error(json);
  json = full();
  json["geometry"] = "images";
  EXPECT_EQ(error(json), "geometry: found none at images, expected a file");
  EXPECT_NE(image::errorOf([&] { readCapture(folder / "none.json"); }).find("none.json: cannot open"),
            std::string::npos);
}

TEST_F(WrongCapture, ADamagedPictureOfUnknownSizeIsNamedItself) {
  image::writeBytes(folder / "images/a.png", "no picture");
  const std::string line = image::errorOf([&] { read(small()); });
  EXPECT_TRUE(line.starts_with((folder / "images/a.png").string())) << line;
}

TEST_F(WrongCapture, AWrongTypeInAnyFieldIsNamedWithItsField) {
  Json json = full();
  json["ortho_height"] = 1;
  json["camera_angle_x"] = 0.556; // 2 atan(3 / 10.5)
  json["camera_angle_y"] = 0.344; // 2 atan(2 / 11.5)
  json["x_fov"] = 31.9, json["y_fov"] = 19.7;
  json["frames"][0]["time"] = 1;
  json["frames"][0]["pl_pos"] = {1, 2, 3};
  json["frames"][0]["pl_intensity"] = {1, 2, 3};
  json["frames"][0].erase("light"); // which would hide pl_pos
  const Json flat = json.flatten();
  size_t fields = 0;
  for (const auto& [pointer, value] : flat.items()) {
    Json wrong = json;
    wrong[Json::json_pointer(pointer)] = Json{{"an", "object"}};
    const std::string line = error(wrong);
    std::string field = fieldOf(pointer);
    // Short lists are one field.
    for (const char* list : {"direction", "irradiance", "irradiance_gradient", "position", "intensity",
                             "pl_pos", "pl_intensity"})
      if (const size_t at = field.find(std::string(list) + "["); at != std::string::npos)
        field.erase(field.rfind('['));
    EXPECT_TRUE(line.starts_with(field + ": found ")) << pointer << ": " << line;
    EXPECT_NE(line.find(", expected "), std::string::npos) << line;
    ++fields;
  }
  EXPECT_GT(fields, 60u);
  for (const char* list : {"/lights", "/frames", "/frames/0", "/lights/1", "/frames/0/transform_matrix/2"}) {
    Json wrong = json;
    wrong[Json::json_pointer(list)] = 7;
    EXPECT_TRUE(error(wrong).starts_with(fieldOf(list) + ": found 7, expected ")) << error(wrong);
  }
}

TEST_F(WrongCapture, AMissingFieldIsNamed) {
  for (const char* pointer :
       {"/frames", "/frames/0/file_path", "/frames/1/transform_matrix", "/lights/0/name", "/lights/0/type",
        "/lights/0/direction", "/lights/0/irradiance", "/lights/1/position", "/lights/1/intensity"}) {
    Json json = full();
    const Json::json_pointer field(pointer);
    json[field.parent_pointer()].erase(field.back());
    EXPECT_TRUE(error(json).starts_with(fieldOf(pointer) + ": found nothing, expected ")) << error(json);
  }
  Json json = small();
  json.erase("camera_angle_x");
  EXPECT_EQ(error(json), "frames[0].fl_x: found nothing, expected a number above 0, or camera_angle_x");
}

TEST_F(WrongCapture, ValuesOutOfRangeAreNamed) {
  const std::pair<const char*, Json> wrongs[] = {{"/w", 0},
                                                 {"/w", 1e9},
                                                 {"/h", 2.5},
                                                 {"/fl_x", 0},
                                                 {"/fl_y", -1},
                                                 {"/camera_angle_x", 3.2},
                                                 {"/k5", 0.1},
                                                 {"/camera_model", "OPENCV_FISHEYE"},
                                                 {"/color_space", "sRGB"},
                                                 {"/frames", Json::array()},
                                                 {"/frames/0/exposure", 0},
                                                 {"/frames/0/split", "val"},
                                                 {"/lights/0/irradiance", {1, 1, 0}},
                                                 {"/lights/1/intensity", {1, -1, 1}},
                                                 {"/lights/0/irradiance", {1, 1, 1e300}},
                                                 {"/lights/0/irradiance", {1, 1e-44, 1}},
                                                 {"/lights/0/irradiance", {3e38, 1, 1}},
                                                 {"/lights/1/intensity", {1, 1, 1.1e12}},
                                                 {"/lights/0/irradiance_gradient", {0, 0, 1e13}},
                                                 {"/lights/1/position", {1e200, 0, 0}},
                                                 {"/lights/1/position", {0, 0, -1.1e12}},
                                                 {"/cx", 1e30},
                                                 {"/cy", -1.1e12},
                                                 {"/frames/0/transform_matrix/1/3", 1e19},
                                                 {"/frames/0/transform_matrix/2/3", -1.1e12},
                                                 {"/lights/0/type", "area"}};
  for (const auto& [pointer, value] : wrongs) {
    Json json = full();
    json[Json::json_pointer(pointer)] = value;
    EXPECT_TRUE(error(json).starts_with(fieldOf(pointer) + ": ")) << error(json);
  }
}

TEST_F(WrongCapture, PlacesAndStrengthsGoAsFarAsTheirBounds) {
  Json json = full();
  json["cx"] = -1e12;
  json["lights"][0]["irradiance"] = {1e-12, 1, 1e12};
  json["lights"][1]["position"] = {1e12, -1e12, 0};
  json["lights"][1]["intensity"] = {1e12, 1e-12, 1};
  json["frames"][0]["transform_matrix"][0][3] = 1e12;
  const Capture capture = read(json);
  EXPECT_EQ(capture.views[0].camera.lens.centerX, -1e12);
  EXPECT_EQ(capture.views[0].camera.center().x(), 1e12);
  EXPECT_EQ(std::get<DirectionalLight>(capture.lights[0].kind).irradiance, (Rgb{1e-12f, 1, 1e12f}));
  EXPECT_EQ(std::get<PointLight>(capture.lights[1].kind).position,
            (Point3<AcquisitionSpace, double>(1e12, -1e12, 0)));
}

TEST_F(WrongCapture, EveryTruncationIsMalformed) {
  const std::string text = full().dump(1);
  for (size_t length = 0; length < text.size(); ++length) {
    const std::string line = image::errorOf([&] { readText(text.substr(0, length)); });
    EXPECT_NE(line.find("transforms.json: malformed JSON in line "), std::string::npos) << line;
  }
}

TEST_F(WrongCapture, DamageGivesAnErrorOrACaptureWhoseIndicesHold) {
  const std::string text = full().dump();
  std::mt19937 random(2);
  int rejected = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = text;
    damaged[random() % text.size()] = "0123456789{}[],:\"\\ eE.-xL\x80"[random() % 26];
    try {
      for (const Capture capture = readText(damaged); const Frame& frame : capture.frames) {
        EXPECT_LT(frame.view, capture.views.size());
        EXPECT_LT(frame.light.value_or(0), capture.lights.size());
      }
    } catch (const Error&) {
      ++rejected;
    }
  }
  EXPECT_GT(rejected, 1000);
}

TEST_F(WrongCapture, DeepNestingAndHugeNumbersAreErrors) {
  EXPECT_NE(image::errorOf([&] { readText(std::string(200000, '[')); }), "");
  EXPECT_NE(image::errorOf([&] { readText("{\"frames\":[1e999]}"); }).find("too large"), std::string::npos);
}

TEST_F(WrongCapture, StrengthsOfLampsAreAllStatedOrNone) {
  Json json = full();
  json.erase("lights");
  for (Json& frame : json["frames"]) {
    frame.erase("light");
    frame["pl_pos"] = {1, 2, 3};
  }
  json["frames"][0]["pl_intensity"] = 16;
  EXPECT_EQ(error(json), "frames[1].pl_intensity: found nothing, expected one, as in the frames before");
  json["frames"][0].erase("pl_intensity");
  json["frames"][1]["pl_intensity"] = 16;
  EXPECT_EQ(error(json), "frames[1].pl_intensity: found 16, expected none, as in the frames before");
}

} // namespace
} // namespace surflect::capture
