#include "srf/import/transforms.h"

#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "srf/image/png.h"
#include "srf/import/import.h"
#include "tests/srf/image/foreign_files.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_formats.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace surflect::importers {
namespace {

using Json = nlohmann::json;

class Transforms : public ::testing::Test {
protected:
  // A frame of NeRF-synthetic: no extension.
  Json frame(const std::string& path, const VisionCamera& camera) const {
    writePicture(folder / (path + ".png"));
    return {{"file_path", "./" + path}, {"transform_matrix", openGlMatrixOf(camera)}};
  }
  // Discs on a clear background with soft edges, whose colours are made by encode(colour, alpha).
  Json discs(const std::function<float(float, float)>& encode) {
    Json frames = Json::array();
    for (int i = 0; i < 3; ++i) {
      Json one = frame("r_" + std::to_string(i), blenderCamera());
      one["file_path"] = "p" + std::to_string(i) + ".png";
      frames.push_back(one);
      image::Image picture(32, 24, 4);
      for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 32; ++x) {
          const auto alpha =
              static_cast<float>(std::clamp((9.5 - std::hypot(x - 15.5, y - 11.5)) / 3, 0., 1.));
          for (size_t c = 0; c < 3; ++c)
            picture.at(x, y)[c] = encode(0.3f + 0.2f * static_cast<float>(c), alpha);
          picture.at(x, y)[3] = alpha;
        }
      image::writePng(folder / one["file_path"].get<std::string>(), picture);
    }
    return frames;
  }
  VisionCamera blenderCamera() {
    VisionCamera camera = rig.camera(false);
    camera.cx = 8, camera.cy = 6;
    camera.fx = camera.fy = 8 / std::tan(0.35);
    return camera;
  }
  void write(const std::string& name, const Json& json) const {
    image::writeBytes(folder / name, json.dump(1));
  }
  ForeignCapture read() const { return readTransforms(folder.path(), false); }
  capture::Capture imported(const ImportOptions& options = {}) const {
    std::filesystem::remove_all(folder / "out");
    importCapture(folder.path(), folder / "out", options);
    return capture::readCapture(folder / "out");
  }
  // file by file, frames that look from random places.
  void writeSplits(std::initializer_list<std::pair<const char*, int>> files) {
    for (const auto& [split, count] : files) {
      Json json{{"camera_angle_x", 0.7}, {"frames", Json::array()}};
      for (int i = 0; i < count; ++i) {
        cameras.push_back(blenderCamera());
        json["frames"].push_back(frame(std::string(split) + "/r_" + std::to_string(i), cameras.back()));
      }
      write(std::string("transforms_") + split + ".json", json);
    }
  }

  image::TemporaryFolder folder;
  VisionRig rig{3};
  std::vector<VisionCamera> cameras; // in the order written
};

TEST_F(Transforms, NerfSyntheticKeepsItsPixelsAndSplits) {
  writeSplits({{"train", 3}, {"test", 2}, {"val", 2}});
  const capture::Capture capture = imported();
  ASSERT_EQ(capture.views.size(), 5u);
  for (size_t v = 0; v < 5; ++v) {
    rig.expectSamePixels(capture.views[v].camera, cameras[v]);
    EXPECT_EQ(capture.frames[v].split, v < 3 ? capture::Split::train : capture::Split::test);
  }
  EXPECT_EQ(capture.views[4].identity, "test/r_1");
  EXPECT_EQ(capture.frames[4].picture, "images/test/r_1.png");
}

TEST_F(Transforms, WithoutTestPhotographsValidationIsTheTest) {
  writeSplits({{"train", 2}, {"valid", 1}});
  const ForeignCapture source = read();
  ASSERT_EQ(source.capture.frames.size(), 3u);
  EXPECT_EQ(source.capture.frames[2].split, capture::Split::test);
  ASSERT_EQ(source.notes.size(), 1u);
  EXPECT_EQ(source.notes[0], "1 validation photographs are the test");
}

TEST_F(Transforms, FilesOfSplitsBesideTheWholeAreSaidToBeLeft) {
  writeSplits({{"train", 2}, {"test", 1}});
  std::filesystem::copy_file(folder / "transforms_train.json", folder / "transforms.json");
  const ForeignCapture source = read();
  EXPECT_EQ(source.capture.frames.size(), 2u);
  EXPECT_EQ(source.notes,
            std::vector<std::string>{
                "transforms.json is read; transforms_train.json and transforms_test.json beside it are not"});
  EXPECT_TRUE(readTransforms(folder / "transforms.json", false).notes.empty()); // as the user has said
}

TEST_F(Transforms, ListsOfNerfstudioAreSplits) {
  Json json{{"fl_x", 20}, {"frames", Json::array()}, {"applied_transform", Json::array()}};
  for (int i = 0; i < 5; ++i) {
    const std::string path = "images/f" + std::to_string(i);
    json["frames"].push_back(frame(path, rig.camera(false)));
    json["frames"].back()["file_path"] = path + ".png";
  }
  json["train_filenames"] = {"images/f0.png", ".\\images\\f3.png"};
  json["val_filenames"] = {"images/f1.png"};
  json["test_filenames"] = {"images/f2.png"};
  write("transforms.json", json);
  const ForeignCapture source = read();
  ASSERT_EQ(source.capture.frames.size(), 3u);
  EXPECT_EQ(source.capture.frames[0].split, capture::Split::train);
  EXPECT_EQ(source.capture.frames[1].split, capture::Split::test);
  EXPECT_EQ(source.capture.frames[1].picture.filename(), "f2.png");
  EXPECT_EQ(source.capture.frames[2].picture.filename(), "f3.png");
  EXPECT_EQ(source.capture.views.size(), 3u);
  EXPECT_EQ(source.notes.size(), 3u); // the transform, validation, what no list names
}

TEST_F(Transforms, NotesOfTheReaderComeThroughOnceAFileWhereTheyDiffer) {
  writeSplits({{"train", 2}, {"test", 1}});
  const auto change = [&](const char* file, const char* frameKey) {
    Json json = Json::parse(std::ifstream(folder / file));
    json["foo"] = 1;
    if (frameKey) json["frames"][0][frameKey] = 2;
    write(file, json);
  };
  change("transforms_train.json", nullptr);
  change("transforms_test.json", nullptr);
  const std::string foo = "1 key is not known and passed over: \"foo\"";
  EXPECT_EQ(read().notes, std::vector<std::string>{foo});
  EXPECT_EQ(importCapture(folder.path(), folder / "out", {}).notes,
            (std::vector<std::string>{foo, "colour: 3 pictures as sRGB (8 bits that state nothing)"}));
  change("transforms_test.json", "bar");
  EXPECT_EQ(read().notes,
            (std::vector<std::string>{foo, "transforms_test.json: 2 keys are not known and passed over: "
                                           "\"bar\" (in 1 frame), \"foo\""}));
  change("transforms_test.json", "is_fisheye");
  EXPECT_TRUE(image::errorOf([&] { read(); })
                  .starts_with((folder / "transforms_test.json").string() +
                               ": frames[0].is_fisheye: found 2, expected "));
}

TEST_F(Transforms, FilesOfDifferentTimesAreRefused) {
  writeSplits({{"train", 2}, {"test", 1}});
  for (const auto& [file, time] :
       {std::pair("transforms_train.json", 0.), std::pair("transforms_test.json", 1.)}) {
    Json json = Json::parse(std::ifstream(folder / file));
    for (Json& frame : json["frames"]) frame["time"] = time;
    write(file, json);
  }
  EXPECT_NE(
      image::errorOf([&] { read(); }).find("transforms_test.json: time: differs from that of another file"),
      std::string::npos);
}

TEST_F(Transforms, OnePoseTwiceIsTwoViewsAgainWhenRead) {
  const VisionCamera camera = blenderCamera();
  Json json{{"camera_angle_x", 0.7}, {"frames", Json::array()}};
  for (const char* name : {"first", "other", "last"})
    json["frames"].push_back(frame(name, std::string(name) == "other" ? blenderCamera() : camera));
  write("transforms.json", json);
  ASSERT_EQ(read().notes.size(), 1u);
  const capture::Capture capture = imported();
  ASSERT_EQ(capture.views.size(), 3u);
  EXPECT_EQ(capture.views[2].identity, "last");
  EXPECT_EQ(capture.frames[2].view, 2u);
  for (const size_t view : {0u, 2u}) rig.expectSamePixels(capture.views[view].camera, camera);
}

TEST_F(Transforms, ListsThatNameNoFrameAreRefused) {
  Json json{{"fl_x", 20}, {"frames", Json::array()}};
  for (const char* name : {"a", "b"}) json["frames"].push_back(frame(name, rig.camera(false)));
  const auto problem = [&](const Json& lists) {
    Json listed = json;
    listed.update(lists);
    write("transforms.json", listed);
    return image::errorOf([&] { importCapture(folder.path(), folder / "out", {}); });
  };
  const std::string file = (folder / "transforms.json").string();
  EXPECT_EQ(problem({{"train_filenames", {"images/a.png"}}}),
            file +
                ": train_filenames: found \"images/a.png\", of no frame, expected the file_path of a frame, "
                "such as \"./a\"");
  EXPECT_NE(problem({{"train_filenames", {"x.png", "y.png"}}, {"test_filenames", {"b"}}})
                .find("found \"x.png\" and 1 more, of no frame"),
            std::string::npos);
  EXPECT_NE(problem({{"test_filenames", {"x.png"}}}).find(file + ": test_filenames: found \"x.png\", of no"),
            std::string::npos);
  EXPECT_EQ(problem({{"test_filenames", {"a", "b"}}}),
            folder.path().string() + ": no photograph is left to train with");
}

TEST_F(Transforms, PointLightsOfRelightingSetsAreKnownAgainInTheTest) {
  writeSplits({{"train", 2}, {"test", 2}});
  const Json positions{{1, 2, 3}, {2, 2, 2}};
  for (const char* file : {"transforms_train.json", "transforms_test.json"}) {
    Json json = Json::parse(std::ifstream(folder / file));
    const bool test = std::string(file).find("test") != std::string::npos;
    for (size_t i = 0; i < 2; ++i) {
      json["frames"][i]["pl_pos"] = test && i == 1 ? Json{9, 9, 9} : positions[1 - i];
      json["frames"][i]["pl_intensity"] = {4, 5, 6};
    }
    write(file, json);
  }
  const capture::Capture capture = imported();
  ASSERT_EQ(capture.lights.size(), 3u);
  ASSERT_EQ(capture.frames.size(), 4u);
  EXPECT_EQ(*capture.frames[2].light, *capture.frames[0].light);
  EXPECT_EQ(std::get<capture::PointLight>(capture.lights[*capture.frames[1].light].kind),
            (capture::PointLight{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(std::get<capture::PointLight>(capture.lights[*capture.frames[3].light].kind),
            (capture::PointLight{{9, 9, 9}, {4, 5, 6}}));
  EXPECT_EQ(std::set<std::string>(
                {capture.lights[0].identity, capture.lights[1].identity, capture.lights[2].identity})
                .size(),
            3u);
}

TEST_F(Transforms, LampsWithoutStrengthAreSaidToBeTakenAsEqual) {
  writeSplits({{"train", 3}, {"test", 1}});
  const auto changeEach = [&](auto change) {
    for (const char* file : {"transforms_train.json", "transforms_test.json"}) {
      Json json = Json::parse(std::ifstream(folder / file));
      for (Json& frame : json["frames"]) change(frame);
      write(file, json);
    }
  };
  const auto lastNote = [&] { return read().notes.back(); };
  changeEach([](Json& frame) { frame["pl_pos"] = {1, 2, 3}; });
  EXPECT_EQ(imported().calibration.at("light_strengths"), "unknown, taken as equal");
  EXPECT_EQ(lastNote(),
            "light strengths are unknown (no pl_intensity) for all photographs; intensity 1 is written");

  Json json = Json::parse(std::ifstream(folder / "transforms_train.json"));
  json["frames"][1]["pl_intensity"] = 2;
  write("transforms_train.json", json);
  const std::string filled =
      "3 of 4 photographs state no light strength (pl_intensity); that of all others is taken, 2";
  EXPECT_EQ(imported().calibration.at("light_strengths"), filled);
  EXPECT_EQ(lastNote(), "warning: " + filled);
  for (const capture::Light& light : imported().lights)
    EXPECT_EQ(std::get<capture::PointLight>(light.kind).intensity, (Rgb{2, 2, 2}));

  json["frames"][2]["pl_intensity"] = 3; // there is no strength of all others
  write("transforms_train.json", json);
  EXPECT_NE(
      image::errorOf([&] {
        read();
      }).find("transforms_train.json: frames[0].pl_intensity: found nothing, expected a strength, as other"),
      std::string::npos);

  changeEach([](Json& frame) { frame["pl_intensity"] = {4, 5, 6}; });
  EXPECT_FALSE(imported().calibration.contains("light_strengths"));
  EXPECT_TRUE(read().notes.empty());
}

TEST_F(Transforms, ASplitThatNobodyHasIsRefused) {
  Json json{{"camera_angle_x", 0.7}, {"frames", Json::array()}};
  for (const char* name : {"a", "b"}) json["frames"].push_back(frame(name, blenderCamera()));
  for (const char* wrong : {"banana", "Train", ""}) {
    json["frames"][1]["split"] = wrong;
    write("transforms.json", json);
    EXPECT_EQ(image::errorOf([&] { read(); }), (folder / "transforms.json").string() +
                                                   ": frames[1].split: found \"" + wrong +
                                                   "\", expected train, val or test");
  }
  for (const char* known : {"test", "val", "valid", "validation"}) {
    json["frames"][1]["split"] = known;
    write("transforms.json", json);
    EXPECT_EQ(read().capture.frames[1].split, capture::Split::test);
  }
}

TEST_F(Transforms, SpellingsOfRelightingSetsAreUnderstood) {
  VisionCamera camera = rig.camera(false);
  Json json{{"camera_intrinsics", {camera.cx, camera.cy, camera.fx, camera.fy}}, {"frames", Json::array()}};
  json["frames"].push_back(frame("a", camera));
  json["frames"][0]["file_ext"] = ".png";
  VisionCamera own = rig.camera(false);
  json["frames"].push_back(frame("b", own));
  json["frames"][1]["camera_intrinsics"] = {own.cx, own.cy, own.fx, own.fy};
  json["frames"][1]["file_path"] = "nowhere";
  json["frames"][1]["img_path"] = "b.png";
  write("transforms.json", json);
  const capture::Capture capture = imported();
  rig.expectSamePixels(viewNamed(capture, "a").camera, camera);
  rig.expectSamePixels(viewNamed(capture, "b").camera, own);
}

TEST_F(Transforms, ACaptureOfOurOwnComesThroughWhole) {
  Json json{
      {"fl_x", 20.5}, {"color_space", "linear"}, {"geometry", "parts/mesh.ply"}, {"frames", Json::array()}};
  std::filesystem::create_directories(folder / "parts");
  image::writeBytes(folder / "parts/mesh.ply", "ply");
  json["lights"] = {
      {{"name", "L"}, {"type", "directional"}, {"direction", {0, 0, 1}}, {"irradiance", {1, 2, 3}}}};
  json["frames"].push_back(frame("a", rig.camera(false)));
  json["frames"][0].update({{"light", "L"}, {"camera", "C"}, {"mask_path", "a.png"}, {"exposure", 2}});
  json["frames"].push_back(json["frames"][0]);
  json["frames"][1]["split"] = "test";
  write("transforms.json", json);
  const capture::Capture before = capture::readCapture(folder.path()), after = imported();
  EXPECT_EQ(after.colorSpace, before.colorSpace);
  EXPECT_EQ(after.lights, before.lights);
  EXPECT_EQ(after.geometry, "geometry/parts/mesh.ply");
  ASSERT_EQ(after.frames.size(), 2u);
  EXPECT_EQ(after.frames[0].exposure, 2);
  EXPECT_EQ(after.frames[0].mask, "masks/a.png");
  EXPECT_EQ(after.frames[1].split, capture::Split::test);
  EXPECT_EQ(after.views.size(), 1u);
  for (const auto& [from, to] :
       {std::pair(folder / "a.png", folder / "out/images/a.png"),
        std::pair(folder / "parts/mesh.ply", folder / "out/geometry/parts/mesh.ply")}) {
    std::ifstream a(from, std::ios::binary), b(to, std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(a), {}),
              std::string(std::istreambuf_iterator<char>(b), {}));
  }
}

TEST_F(Transforms, ExposureBracketsComeAlong) {
  Json json{{"fl_x", 20}, {"frames", Json::array()}};
  const VisionCamera camera = rig.camera(false);
  for (const char* path : {"short", "long"}) json["frames"].push_back(frame(path, camera));
  json["frames"][0].update({{"camera", "C"}, {"exposure", 0.25}});
  json["frames"][1].update({{"camera", "C"}, {"exposure", 4}});
  write("transforms.json", json);
  const capture::Capture capture = imported();
  ASSERT_EQ(capture.frames.size(), 1u);
  ASSERT_EQ(capture.frames[0].further.size(), 1u);
  EXPECT_EQ(capture.frames[0].picture, "images/short.png");
  EXPECT_EQ(capture.frames[0].further[0].picture, "images/long.png");
  EXPECT_EQ(capture.frames[0].further[0].exposure, 4);
}

TEST_F(Transforms, PicturesOfOneViewHaveOneSize) {
  Json json{{"fl_x", 20}, {"frames", Json::array()}};
  json["frames"].push_back(frame("a", rig.camera(false)));
  json["frames"][0]["mask_path"] = "mask.png";
  write("transforms.json", json);
  writePicture(folder / "mask.png", 16, 11);
  EXPECT_NE(image::errorOf([&] {
              importCapture(folder.path(), folder / "out", {});
            }).find("mask.png: size: found 16 x 11, expected 16 x 12"),
            std::string::npos);
}

TEST_F(Transforms, MasksOfTheSourceNeedNotBeRightWhereOthersAreMade) {
  Json json{{"fl_x", 20}, {"frames", Json::array()}};
  json["frames"].push_back(frame("a", rig.camera(false)));
  json["frames"][0]["mask_path"] = "masks/a.png";
  write("transforms.json", json);
  ImportOptions options;
  options.masks = MaskMaking{.threshold = 0.5};
  writePicture(folder / "masks/a.png", 16, 11);
  for (const bool readable : {true, false}) {
    if (!readable) image::writeBytes(folder / "masks/a.png", "no picture");
    std::filesystem::remove_all(folder / "out");
    const std::vector<std::string> notes = importCapture(folder.path(), folder / "out", options).notes;
    EXPECT_EQ(notes.at(0), "1 mask of the source is not used: --mask-from makes others");
    const std::filesystem::path mask = capture::readCapture(folder / "out").frames[0].mask;
    EXPECT_EQ(image::readPictureSize(folder / "out" / mask), (image::PictureSize{16, 12}));
  }
}

TEST_F(Transforms, PathsOutOfTheFolderNeedPermission) {
  const std::filesystem::path inner = folder / "inner";
  std::filesystem::create_directories(inner);
  Json json{{"fl_x", 20}, {"frames", Json::array()}};
  json["frames"].push_back(frame("a", rig.camera(false)));
  for (const std::string& path : {std::string("../a"), (folder / "a.png").string()}) {
    json["frames"][0]["file_path"] = path;
    image::writeBytes(inner / "transforms.json", json.dump());
    EXPECT_NE(image::errorOf([&] { readTransforms(inner, false); }).find("a path inside"), std::string::npos);
    std::filesystem::remove_all(folder / "out");
    ImportOptions options;
    options.allowOutside = true;
    importCapture(inner, folder / "out", options);
    EXPECT_EQ(capture::readCapture(folder / "out").frames[0].picture, "images/a.png");
  }
  json["frames"][0]["file_path"] = "link.png";
  image::writeBytes(inner / "transforms.json", json.dump());
  std::filesystem::create_symlink(folder / "a.png", inner / "link.png");
  EXPECT_NE(image::errorOf([&] { readTransforms(inner, false); }).find("--allow-outside"), std::string::npos);
}

TEST_F(Transforms, FilesThatDisagreeAreRefused) {
  writeSplits({{"train", 1}, {"test", 1}});
  const Json train = Json::parse(std::ifstream(folder / "transforms_train.json"));
  Json test = Json::parse(std::ifstream(folder / "transforms_test.json"));
  test["frames"][0]["pl_pos"] = {1, 2, 3};
  write("transforms_test.json", test);
  EXPECT_NE(
      image::errorOf([&] { read(); }).find("transforms_test.json: frames[0].light: one file has lights"),
      std::string::npos);
  test["frames"][0].erase("pl_pos");
  test["color_space"] = "linear";
  write("transforms_test.json", test);
  EXPECT_EQ(read().capture.colorSpace, capture::ColorSpace::linear);
  Json other = train;
  other["color_space"] = "srgb";
  write("transforms_train.json", other);
  EXPECT_NE(image::errorOf([&] { read(); }).find("transforms_test.json: color_space: differs"),
            std::string::npos);
}

TEST_F(Transforms, ComplaintsOfTheReaderComeThrough) {
  Json json{{"fl_x", 20}, {"frames", Json::array()}};
  json["frames"].push_back(frame("a", rig.camera(false)));
  const std::string text = json.dump();
  for (size_t length = 0; length < text.size(); ++length) {
    image::writeBytes(folder / "transforms.json", text.substr(0, length));
    EXPECT_NE(image::errorOf([&] { read(); }).find("transforms.json: malformed JSON"), std::string::npos);
  }
  for (const char* wrong :
       {"[]", "3", "{}", "{\"frames\": 3}", "{\"frames\": []}", "{\"frames\": [3]}", "{\"frames\": [{}]}",
        "{\"frames\": [{\"split\": 3, \"file_path\": \"a.png\"}]}"}) {
    image::writeBytes(folder / "transforms.json", wrong);
    EXPECT_NE(image::errorOf([&] { read(); }).find("transforms.json: "), std::string::npos) << wrong;
  }
  image::writeBytes(folder / "transforms.json", std::string(100000, '['));
  EXPECT_NE(image::errorOf([&] { read(); }).find("nested too deeply"), std::string::npos);
}

// Phones store turned pixels, and other programs state the lens of the upright picture.
TEST_F(Transforms, ExifIsNamedWhereTheLensIsThatOfTheTurnedPicture) {
  using namespace std::string_literals;
  const auto exif = [](char orientation) {
    return image::jpegSegment('\xe1', "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s +
                                          orientation + "\0\0\0\0\0\0"s);
  };
  Json one = frame("r_0", blenderCamera());
  one["file_path"] = "a.jpg";
  const auto complaint = [&](char orientation) {
    image::writeBytes(folder / "a.jpg", image::grayJpeg(exif(orientation))); // 16 x 8
    write("transforms.json", {{"fl_x", 20}, {"w", 80}, {"h", 160}, {"frames", {one}}});
    return image::errorOf([&] { imported(); });
  };
  EXPECT_NE(
      complaint(6).find("a.jpg: size: found 16 x 8, expected 80 x 160 or of that shape: EXIF orientation 6 "
                        "turns the picture to it"),
      std::string::npos)
      << complaint(6);
  EXPECT_EQ(complaint(3).find("EXIF"), std::string::npos); // upside down has the same shape
}

// Every picture is read once before anything is written.
TEST_F(Transforms, DamagedPicturesAreRefused) {
  writeSplits({{"train", 3}});
  const std::string whole = readFile(folder / "train/r_1.png");
  image::writeBytes(folder / "train/r_1.png", whole.substr(0, whole.size() * 6 / 10));
  EXPECT_NE(image::errorOf([&] { imported(); }).find("train/r_1.png: cannot read (the file is truncated)"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(Transforms, PicturesThatLookCutOffWithinTheObjectAreTold) {
  Json frames = Json::array();
  for (int i = 0; i < 3; ++i) {
    Json one = frame("r_" + std::to_string(i), blenderCamera());
    const std::string name = "p" + std::to_string(i);
    one["file_path"] = name + ".ppm";
    one["mask_path"] = name + "_mask.png";
    frames.push_back(one);
    std::string pixels;
    for (int y = 0; y < 12; ++y)
      for (int x = 0; x < 16; ++x) // 0: whole; 1: ends early; 2: fades
        pixels += std::string(3, static_cast<char>(i == 1 && y * 16 + x > 100 ? 0
                                                   : i == 2                   ? std::max(0, 120 - y * 16 - x)
                                                                              : 99));
    image::writeBytes(folder / (name + ".ppm"), "P6\n16 12\n255\n" + pixels);
    image::Image mask(16, 12, 1);
    std::ranges::fill(mask.values, 1.f);
    mask.values[0] = 0;
    image::writePng(folder / (name + "_mask.png"), mask);
  }
  write("transforms.json", {{"fl_x", 20}, {"frames", frames}});
  const auto notes = importCapture(folder.path(), folder / "out", {}).notes;
  const std::string text = "warning: 1 of 3 pictures are black from somewhere within the object on, as after "
                           "an interrupted copy: p1.ppm";
  EXPECT_NE(std::ranges::find(notes, text), notes.end()) << notes.size();
}

TEST_F(Transforms, StraightColoursAndPartsOfAnExrAreTold) {
  Json frames = Json::array();
  for (int i = 0; i < 2; ++i) {
    Json one = frame("r_" + std::to_string(i), blenderCamera());
    one["file_path"] = "p" + std::to_string(i) + ".exr";
    frames.push_back(one);
    image::Image picture(16, 12, 4);
    for (size_t texel = 0; texel < 16 * 12; ++texel) {
      const bool isObject = texel % 16 > 7;
      for (size_t c = 0; c < 3; ++c) picture.values[4 * texel + c] = isObject || i == 1 ? 0.5f : 0;
      picture.values[4 * texel + 3] = isObject ? 1.f : 0;
    }
    image::writeExr(folder / one["file_path"].get<std::string>(), picture);
  }
  write("transforms.json", {{"fl_x", 20}, {"frames", frames}});
  const auto notes = importCapture(folder.path(), folder / "out", {}).notes;
  EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
    return note.starts_with("warning: 1 of 2 pictures have colours where alpha is 0") &&
           note.ends_with(": p1.exr");
  }));
}

TEST_F(Transforms, ColoursOfEdgesAreTold) {
  const auto noteOn = [&](const char* out, const std::function<float(float, float)>& encode) {
    write("transforms.json", {{"fl_x", 20}, {"frames", discs(encode)}});
    for (const std::string& note : importCapture(folder.path(), folder / out, {}).notes)
      if (note.find("where alpha is below 1") != note.npos) return note;
    return std::string();
  };
  EXPECT_EQ(noteOn("straight", [](float color, float) { return color; }), "");
  EXPECT_TRUE(noteOn("multiplied", [](float color, float alpha) {
                return color * alpha;
              }).starts_with("warning: 3 of 3 pictures have colours that look multiplied by alpha"));
  EXPECT_TRUE(noteOn("white", [](float color, float alpha) {
                return color * alpha + 1 - alpha;
              }).starts_with("warning: 3 of 3 pictures have colours that look mixed with white"));
}

TEST_F(Transforms, ColoursMultipliedByAlphaAreDividedOnRequest) {
  write("transforms.json",
        {{"fl_x", 20}, {"frames", discs([](float color, float alpha) { return color * alpha; })}});
  const auto notes = importCapture(folder.path(), folder / "out", {.fixPremult = true}).notes;
  EXPECT_TRUE(std::ranges::none_of(
      notes, [](const std::string& note) { return note.find("multiplied") != note.npos; }));
  const image::Image picture = image::readPicture(folder / "out/images/p1.png").image;
  for (int x = 0; x < 32; ++x)
    if (const float alpha = picture.at(x, 11)[3]; alpha > 0)
      EXPECT_NEAR(picture.at(x, 11)[0], 0.3f, 1 / (255 * alpha)) << x;
}

} // namespace
} // namespace surflect::importers
