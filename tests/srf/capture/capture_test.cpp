#include "srf/capture/capture.h"

#include "tests/srf/capture/capture_file.h"

#include <numbers>
#include <random>
#include <vector>

namespace surflect::capture {
namespace {

using testing::CaptureFile, testing::Json, testing::fieldOf;

TEST_F(CaptureFile, EveryFieldIsRead) {
  const Capture capture = read(full());
  EXPECT_EQ(capture.folder(), folder.path());
  EXPECT_EQ(capture.colorSpace, ColorSpace::srgb);
  EXPECT_EQ(capture.geometry, "mesh.ply");
  EXPECT_EQ(capture.lights,
            (std::vector<Light>{{"L00", "L00", DirectionalLight{{0, 0.6, 0.8}, {1, 2, 3}, {0.1, -0.2, 0.3}}},
                                {"P01", "L00", PointLight{{1, 2, 3}, {4, 5, 6}}}}));
  ASSERT_EQ(capture.views.size(), 1u);
  EXPECT_EQ(capture.views[0].identity, "C00");
  EXPECT_EQ(capture.views[0].camera.lens,
            (Lens{Lens::Model::pinhole, 6, 4, 10.5, 11.5, 3.25, 1.75, 0.01, 0.02, 0.03, 0.04, 0.005}));
  EXPECT_EQ(capture.views[0].camera.center(), (Point3<AcquisitionSpace, double>(0, 0, 5)));
  EXPECT_EQ(capture.frames,
            (std::vector<Frame>{{0, 0, "images/a.png", "", "", 0.5, "mask.png", Split::train},
                                {0, 1, "images/b.exr", "Combined_P01", "Combined", 1, "", Split::test}}));
}

TEST_F(CaptureFile, AJsonFileOfAnotherNameCanBeGiven) {
  image::writeBytes(folder / "deformed.json", full().dump());
  EXPECT_EQ(readCapture(folder / "deformed.json").frames.size(), 2u);
  EXPECT_EQ(readCapture(folder / "deformed.json").folder(), folder.path());
}

TEST_F(CaptureFile, FixedLightFilesOfOtherProgramsOpenAsTheyAre) {
  Json json = small();
  json["aabb_scale"] = 16;
  json["camera_model"] = "OPENCV";
  json["is_fisheye"] = false;
  json["frames"][0]["rotation"] = 0.01;
  const Capture capture = read(json);
  EXPECT_TRUE(capture.notes.empty());
  const Frame& frame = capture.frames.at(0);
  EXPECT_EQ(frame.light, std::nullopt);
  EXPECT_EQ(frame.split, Split::train);
  EXPECT_EQ(frame.picture, "images/a.png"); // the extension was found
  EXPECT_EQ(capture.views.at(0).identity, "images/a");
  const Lens& lens = capture.views[0].camera.lens;
  EXPECT_EQ(lens, (Lens{Lens::Model::pinhole, 6, 4, lens.focalX, lens.focalX, 3, 2})); // the picture's size
  // The angle is between the rays through the left and the right edge.
  const auto left = rayThrough(lens, {0, 2}), right = rayThrough(lens, {6, 2});
  EXPECT_NEAR(std::acos(dot(left->direction, right->direction)), 0.5, 1e-12);
}

TEST_F(CaptureFile, KeysThatChangeTheMeaningAreRefusedUnlessTheySayNothing) {
  const std::pair<const char*, Json> wrongs[] = {{"/is_fisheye", true},
                                                 {"/isFisheye", true},
                                                 {"/ftheta_p1", 0.5},
                                                 {"/latlong", true},
                                                 {"/equirectangular", 1},
                                                 {"/lens_mode", "FTheta"},
                                                 {"/camera_type", "fisheye"},
                                                 {"/distortion_params", {0, 0, 0.1}},
                                                 {"/k4", 0.1},
                                                 {"/rolling_shutter", {0, 0, 0.5, 0}},
                                                 {"/from_na", true},
                                                 {"/camera_convention", "OPENCV"},
                                                 {"/white_transparent", true},
                                                 {"/intrinsic_matrix", {{1, 0}, {0, 1}}},
                                                 {"/train_filenames", {"images/a.png"}},
                                                 {"/exposure", 2},
                                                 {"/frames/0/is_fisheye", true},
                                                 {"/frames/0/k6", -1},
                                                 {"/frames/0/camera_intrinsics", {3, 2, 10, 10}},
                                                 {"/frames/0/transform_matrix_end", Json::array({1, 0})},
                                                 {"/frames/0/driver_parameters", {{"LightX", 1}}},
                                                 {"/frames/0/color_space", "srgb"},
                                                 {"/mask", "masks"},
                                                 {"/frames/0/mask_file", "mask.png"},
                                                 {"/frames/0/alpha_path", "alpha.png"},
                                                 {"/gamma", 2.2},
                                                 {"/colorspace", "linear"},
                                                 {"/frames/0/input_color_space", "ACEScg"},
                                                 {"/colour_profile", "sRGB"}};
  for (const auto& [pointer, value] : wrongs) {
    Json json = small();
    json[Json::json_pointer(pointer)] = value;
    EXPECT_TRUE(error(json).starts_with(fieldOf(pointer) + ": found " + value.dump() + ", expected "))
        << error(json);
  }
  Json json = small();
  json.update({{"is_fisheye", false},
               {"k4", 0},
               {"ftheta_p0", 0.0},
               {"rolling_shutter", {0, 0, 0, 0}},
               {"lens_mode", "Perspective"},
               {"camera_type", "pinhole"},
               {"camera_convention", "opengl"},
               {"latlong", nullptr},
               {"distortion_model", "none"},
               {"driver_parameters", Json::object()},
               {"has_foreground_mask", false},
               {"alpha", nullptr},
               {"Color_Space", ""}});
  json["frames"][0]["transform_matrix_start"] = json["frames"][0]["transform_matrix"];
  EXPECT_TRUE(read(json).notes.empty());
}

TEST_F(CaptureFile, KnownKeysInOtherLettersAreRefusedWithTheirSpelling) {
  for (const auto& [pointer, spelling] :
       {std::pair("/frames/0/Mask_Path", "mask_path"), std::pair("/Color_Space", "color_space"),
        std::pair("/frames/0/ALPHA_LAYER", "alpha_layer"), std::pair("/Fl_X", "fl_x"),
        std::pair("/lights/0/Cluster", "cluster")}) {
    Json json = full();
    json[Json::json_pointer(pointer)] = "x";
    EXPECT_EQ(error(json), fieldOf(pointer) + ": found \"x\", expected " + spelling);
  }
}

TEST_F(CaptureFile, UnknownKeysAreNamedInOneNote) {
  Json json = small();
  json["foo"] = 1;
  json["frames"].push_back(json["frames"][0]);
  json["frames"][1]["split"] = "test";
  json["frames"][0]["bar\n"] = {1, 2};
  json["frames"][0]["baz"] = json["frames"][1]["baz"] = "";
  EXPECT_EQ(read(json).notes,
            (std::vector<std::string>{"3 keys are not known and passed over: \"bar?\" (in 1 frame), "
                                      "\"baz\" (in 2 frames), \"foo\""}));
  json = full();
  json["lights"][0]["colour"] = 1;
  EXPECT_EQ(read(json).notes,
            std::vector<std::string>{"1 key is not known and passed over: \"colour\" (in 1 light)"});
  json = full();
  json["frames"][1]["expsure"] = 1;
  json["origni"] = {0, 0, 0};
  EXPECT_EQ(read(json).notes, std::vector<std::string>{
                                  "2 keys are not known and passed over: \"expsure\" (in 1 frame); did you "
                                  "mean exposure?, \"origni\"; did you mean origin?"});
  json = small();
  for (int i = 0; i < 12; ++i) json["key" + std::to_string(10 + i)] = i;
  EXPECT_TRUE(read(json).notes.at(0).ends_with("\"key18\", \"key19\" and 2 more"));
}

TEST_F(CaptureFile, BothAnglesOrFocalLengthsMakePixelsThatAreNotSquare) {
  // 6 x 4 pixels; f = size / 2 / tan(angle / 2).
  const double angleX = 2 * std::atan(3 / 12.), angleY = 2 * std::atan(2 / 9.),
               degrees = 180 / std::numbers::pi;
  const auto lensOf = [&](const Json& angles) {
    Json json = small();
    json.erase("camera_angle_x");
    json.update(angles);
    return read(json);
  };
  for (const Json& both : {Json{{"camera_angle_x", angleX}, {"camera_angle_y", angleY}},
                           Json{{"x_fov", angleX * degrees}, {"y_fov", angleY * degrees}},
                           Json{{"fl_x", 12}, {"camera_angle_y", angleY}}}) {
    const Capture capture = lensOf(both);
    EXPECT_NEAR(capture.views[0].camera.lens.focalX, 12, 1e-13);
    EXPECT_NEAR(capture.views[0].camera.lens.focalY, 9, 1e-13);
    ASSERT_EQ(capture.notes.size(), 1u);
    EXPECT_EQ(capture.notes[0], "pixels are not square in 1 frame, as camera_angle_y (or y_fov) says: focal "
                                "lengths are 12 and 9 pixels");
  }
  EXPECT_NE(image::errorOf([&] {
              lensOf({{"camera_angle_y", angleY}});
            })
                .find("frames[0].fl_x: found nothing, expected a number above 0, or camera_angle_x, as the "
                      "vertical one "
                      "does not say whether pixels are square"),
            std::string::npos);
}

TEST_F(CaptureFile, WidthOrHeightAloneKeepsTheShapeOfThePicture) {
  Json json = small();
  const auto sizeOf = [&] {
    const Lens lens = read(json).views[0].camera.lens;
    return std::pair(lens.width, lens.height);
  };
  EXPECT_EQ(sizeOf(), std::pair(6, 4));
  json["w"] = 12;
  EXPECT_EQ(sizeOf(), std::pair(12, 8));
  json.erase("w");
  json["frames"][0]["h"] = 2;
  EXPECT_EQ(sizeOf(), std::pair(3, 2));
}

TEST_F(CaptureFile, AFocalLengthOfAStatedSizeGoesBeforeAnotherAngle) {
  Json json = small();
  json["camera_angle_x"] = 0.49; // 2 atan(3 / 12) = 0.48996
  json["fl_x"] = 12;
  EXPECT_EQ(read(json).views[0].camera.lens.focalX, 12);
  EXPECT_TRUE(read(json).notes.empty());
  json["fl_x"] = 24;
  EXPECT_EQ(error(json), "frames[0].fl_x: found 24, expected about 11.998912, as camera_angle_x (or x_fov) "
                         "says, or w and h");
  json.update({{"w", 6}, {"h", 4}, {"fl_y", 24}, {"camera_angle_y", 0.166}}); // 2 atan(2 / 24) = 0.1663
  const Capture capture = read(json);
  EXPECT_EQ(capture.views[0].camera.lens.focalX, 24);
  EXPECT_EQ(capture.notes,
            std::vector<std::string>{"angles are not those of the focal lengths, which count: fl_x "
                                     "is 24, camera_angle_x (or x_fov) would be 11.998912 pixels"});
  json["frames"][0]["fl_x"] = 24; // a frame's own lens is no contradiction
  EXPECT_TRUE(read(json).notes.empty());
  json["x_fov"] = 60;
  EXPECT_TRUE(error(json).starts_with("x_fov: found 60, expected about 28.07")) << error(json);
}

TEST_F(CaptureFile, WhatAFrameSaysOverridesTheCapture) {
  Json json = full();
  json["frames"][1].update(
      {{"w", 8}, {"h", 2}, {"cx", 4}, {"k1", 0}, {"camera_angle_x", std::numbers::pi / 2}});
  const Capture capture = read(json);
  ASSERT_EQ(capture.views.size(), 2u);
  const Lens &first = capture.views[0].camera.lens, &second = capture.views[1].camera.lens;
  EXPECT_EQ(first.focalX, 10.5);
  EXPECT_NEAR(second.focalX, 4, 1e-14); // its angle, not the capture's fl_x
  EXPECT_EQ(second, (Lens{Lens::Model::pinhole, 8, 2, second.focalX, second.focalX, 4, 1.75, 0, 0.02, 0.03,
                          0.04, 0.005}));
}

TEST_F(CaptureFile, AnOrthographicLensHasItsHeightInSceneUnits) {
  Json json = small();
  json["camera_model"] = "orthographic";
  json["ortho_height"] = 2;
  const Lens lens = read(json).views[0].camera.lens;
  EXPECT_EQ(lens.model, Lens::Model::orthographic);
  EXPECT_EQ(rayThrough(lens, {3, 0})->origin.y() - rayThrough(lens, {3, 4})->origin.y(), 2);
  json.erase("ortho_height");
  EXPECT_EQ(error(json), "frames[0].ortho_height: found nothing, expected a number above 0");
}

TEST_F(CaptureFile, PhotographsFromOnePlaceShareAView) {
  Json json = full();
  Json third = json["frames"][1];
  third["transform_matrix"][0][3] = 1e-6;
  json["frames"].push_back(third);
  third["camera"] = "C01";
  json["frames"].push_back(third);
  const Capture capture = read(json);
  ASSERT_EQ(capture.views.size(), 3u); // one more for the moved pose, one more for the other camera
  EXPECT_EQ(capture.frames[1].view, 0u);
  EXPECT_EQ(capture.views[1].identity, "C00");
  EXPECT_EQ(capture.views[2].identity, "C01");
}

TEST_F(CaptureFile, LightsWrittenIntoFramesAreSharedWhereEqual) {
  Json json = small();
  json["frames"][0]["pl_pos"] = {1, 2, 3};
  json["frames"][0]["pl_intensity"] = {4, 5, 6};
  for (int i = 0; i < 2; ++i) json["frames"].push_back(json["frames"][0]);
  json["frames"][1]["pl_pos"] = {1, 2, 4};
  json["frames"][2]["split"] = "test";
  const Capture capture = read(json);
  ASSERT_EQ(capture.lights.size(), 2u);
  EXPECT_NE(capture.lights[0].name, capture.lights[1].name);
  EXPECT_EQ(std::get<PointLight>(capture.lights[0].kind), (PointLight{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(capture.frames[1].light, 1u);
  EXPECT_EQ(capture.frames[2].light, 0u);
}

TEST_F(CaptureFile, NamedAndUnnamedViewsOfOnePlaceAreTwo) {
  Json json = small();
  for (int i = 0; i < 3; ++i) json["frames"].push_back(json["frames"][0]);
  json["frames"][1]["camera"] = "images/a"; // as the unnamed one is called
  json["frames"][2]["transform_matrix"][0][1] = -0.0;
  json["frames"][2]["split"] = json["frames"][3]["split"] = "test";
  const Capture capture = read(json);
  ASSERT_EQ(capture.views.size(), 2u);
  EXPECT_EQ(capture.frames[1].view, 1u);
  EXPECT_EQ(capture.frames[2].view, 0u);
}

TEST_F(CaptureFile, FramesOfTheirOwnPlaceAndLampAreAsManyViewsAndLights) {
  Json json = small();
  json.update({{"w", 6}, {"h", 4}});
  Json frame = json["frames"][0];
  frame["file_path"] = "images/a.png";
  json["frames"] = Json::array();
  constexpr int count = 3000;
  for (int i = 0; i < count; ++i) {
    frame["transform_matrix"][0][3] = i;
    frame["pl_pos"] = {i, 1, 2};
    json["frames"].push_back(frame);
  }
  const Capture capture = read(json);
  EXPECT_EQ(capture.views.size(), size_t{count});
  EXPECT_EQ(capture.lights.size(), size_t{count});
}

TEST_F(CaptureFile, RoundingOfAPoseIsTakenOut) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (const double unit : {1e-6, 1e-5, 1e-4, 1e-3})
    for (int i = 0; i < 20; ++i) {
      const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
      const Mat3<double> rotation = q.normalized().toRotationMatrix();
      Json json = small();
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          json["frames"][0]["transform_matrix"][row][column] =
              std::round(rotation(row, column) / unit) * unit;
      const Capture capture = read(json);
      const Mat3<double> found = capture.views[0].camera.cameraFromWorld.rotation();
      EXPECT_NEAR((found * found.transpose() - Mat3<double>::Identity()).norm(), 0, 3e-15);
      EXPECT_NEAR((found.transpose() - rotation).norm(), 0, 1.5 * unit);
      EXPECT_TRUE(unit > 5e-5 || capture.notes.empty());
    }
}

TEST_F(CaptureFile, RotationsThatAreOffByMoreThanATenThousandthAreSaid) {
  Json json = small();
  const auto add = [&](double sine, double scale = 1) {
    Json frame = json["frames"][0];
    const std::string picture = "images/a" + std::to_string(json["frames"].size()) + ".png";
    image::writePng(folder / picture, image::Image(6, 4, 3));
    frame["file_path"] = picture;
    frame["transform_matrix"] = {
        {scale, scale * sine, 0, json["frames"].size()}, {0, scale, 0, 0}, {0, 0, scale, 5}, {0, 0, 0, 1}};
    json["frames"].push_back(frame);
  };
  for (const double sine : {9e-5, 2e-4, 0.0015}) add(sine);
  EXPECT_EQ(read(json).notes,
            std::vector<std::string>{
                "2 rotations are rounded, off by up to 0.0015; the nearest rotation is taken"});
  json["frames"].erase(3), json["frames"].erase(2);
  add(0, 0.25), add(0, 2);
  const Capture capture = read(json); // a camera's scale turns no ray
  EXPECT_EQ(capture.notes,
            std::vector<std::string>{"2 rotations are scaled, by 0.25 to 2; the scale is left out"});
  EXPECT_NEAR((capture.views[3].camera.cameraFromWorld.rotation() - Mat3<double>::Identity()).norm(), 0,
              1e-15);
  EXPECT_NEAR((capture.views[3].camera.center().raw() - Vec3<double>(3, 0, 5)).norm(), 0, 1e-15);
}

TEST_F(CaptureFile, PosesThatAreNotRigidAreNamed) {
  const std::string field = "frames[0].transform_matrix";
  Json json = small();
  json["frames"][0]["transform_matrix"][1][1] = 2;
  EXPECT_EQ(error(json), field + ": found a matrix that is not orthonormal by 3, expected a rotation, with 3 "
                                 "decimals or more");
  for (const double shear : {0.0025, 0.01}) {
    json = small();
    json["frames"][0]["transform_matrix"][0][1] = shear;
    EXPECT_NE(error(json).find("not orthonormal by " + numberText(shear)), std::string::npos) << error(json);
  }
  json = small();
  json["frames"][0]["transform_matrix"][0][0] = -1;
  EXPECT_EQ(error(json), field + ": found a reflection, expected a rotation");
  json = small();
  json["frames"][0]["transform_matrix"][3][0] = 1;
  EXPECT_NE(error(json).find(field + "[3]: "), std::string::npos);
}

TEST_F(CaptureFile, LightDirectionsMustBeUnitButForRounding) {
  Json json = full();
  json["lights"][0]["direction"] = {0, 0.6003, 0.8004};
  const Capture capture = read(json);
  EXPECT_NEAR(length(std::get<DirectionalLight>(capture.lights[0].kind).towards), 1, 1e-15);
  json["lights"][0]["direction"] = {0, 0.602, 0.802};
  EXPECT_EQ(error(json), "lights[0].direction: found length 1.0028001, expected a unit vector");
  json["lights"][0]["direction"] = {0, 0, 0};
  EXPECT_EQ(error(json), "lights[0].direction: found length 0, expected a unit vector");
}

TEST_F(CaptureFile, AnUnknownLightComesWithKnownOnes) {
  Json json = full();
  json["frames"][1]["light"] = "P02";
  EXPECT_EQ(error(json), "frames[1].light: found \"P02\", expected a light of the list: L00, P01");
  json["frames"][1]["light"] = "L0O";
  EXPECT_NE(error(json).find("; did you mean L00?"), std::string::npos);
}

TEST_F(CaptureFile, NamesOfLightsAreUnique) {
  Json json = full();
  json["lights"][1]["name"] = "L00";
  EXPECT_EQ(error(json), "lights[1].name: a second light is called L00");
}

TEST_F(CaptureFile, FramesThatDifferInExposureAloneAreOneBracket) {
  Json json = full();
  for (const auto& [exposure, layer] : {std::pair(4., "long"), std::pair(0.125, "short")}) {
    json["frames"].push_back(json["frames"][0]);
    json["frames"].back().update({{"exposure", exposure}, {"layer", layer}});
  }
  const Capture capture = read(json);
  ASSERT_EQ(capture.frames.size(), 2u);
  EXPECT_EQ(bracketOf(capture.frames[0]), (std::vector<Exposure>{{"images/a.png", "", "", 0.5},
                                                                 {"images/a.png", "long", "", 4},
                                                                 {"images/a.png", "short", "", 0.125}}));
  EXPECT_EQ(bracketOf(capture.frames[1]).size(), 1u);
  json["frames"][3].erase("mask_path");
  EXPECT_EQ(error(json), "frames[3].mask_path: found none, expected that of the other exposures, mask.png");
}

TEST_F(CaptureFile, OfOneExposureAViewHasAnyNumberOfTestFrames) {
  Json json = full();
  json["frames"].push_back(json["frames"][0]);
  for (const double exposure : {0.5, 1., 0.5, 1.}) { // two brackets of two
    json["frames"][2]["split"] = "test";
    json["frames"][2]["exposure"] = exposure;
    json["frames"].push_back(json["frames"][2]);
  }
  json["frames"].erase(2);
  const Capture capture = read(json);
  ASSERT_EQ(capture.frames.size(), 4u);
  for (const size_t i : {2u, 3u}) EXPECT_EQ(bracketOf(capture.frames[i]).size(), 2u);
}

TEST_F(CaptureFile, APictureOfAnotherCameraIsNoted) {
  Json json = small();
  Json moved = json["frames"][0];
  moved["transform_matrix"][0][3] = moved["transform_matrix"][0][3].get<double>() + 1;
  json["frames"].push_back(moved);
  EXPECT_EQ(read(json).notes, (std::vector<std::string>{
                                  "1 frame shows the picture of another camera or light (images/a.png)"}));
}

TEST_F(CaptureFile, ASecondPhotographOfOneViewAndLightIsAViewOfItsOwn) {
  for (const bool named : {false, true}) {
    Json json = small();
    if (named) json["frames"][0]["camera"] = "C";
    Json again = json["frames"][0];
    json["frames"].push_back(again); // the very same picture, which is taken once
    again["file_path"] = "mask.png";
    json["frames"].push_back(again);
    again["exposure"] = 4;
    again["file_path"] = "images/a.png";
    json["frames"].push_back(again); // one more exposure of the second
    const Capture capture = read(json);
    ASSERT_EQ(capture.views.size(), 2u);
    EXPECT_EQ(capture.views[1].identity, named ? "C" : "mask");
    EXPECT_EQ(capture.views[1].camera.lens, capture.views[0].camera.lens);
    EXPECT_EQ(capture.views[1].camera.center(), capture.views[0].camera.center());
    EXPECT_EQ(
        capture.frames,
        (std::vector<Frame>{{.view = 0, .picture = "images/a.png"},
                            {.view = 1, .picture = "mask.png", .further = {{"images/a.png", "", "", 4}}}}));
    EXPECT_EQ(capture.notes,
              (std::vector<std::string>{"1 photograph with view and light of another (mask.png that of "
                                        "images/a.png): each is kept as a view of its own",
                                        "1 frame is listed twice, and taken once"}));
  }
}

TEST_F(CaptureFile, FramesAreOfOneTime) {
  Json json = small();
  json["frames"].push_back(json["frames"][0]);
  json["frames"][0]["time"] = 0.5;
  json["frames"][1]["split"] = "test";
  EXPECT_EQ(read(json).time, 0.5);
  json["frames"][1]["time"] = 0.5;
  EXPECT_EQ(read(json).time, 0.5);
  json["frames"][1]["time"] = 0.75;
  EXPECT_EQ(error(json), "frames[1].time: found 0.75, expected 0.5, as in the frames before: the frames are "
                         "of several times, a model shows one");
}

TEST_F(CaptureFile, BackslashesStandForSlashes) {
  Json json = full();
  json["frames"][0]["file_path"] = ".\\images\\a.png";
  json["frames"][0]["mask_path"] = ".\\mask.png";
  json["geometry"] = "images\\..\\mesh.ply";
  const Capture capture = read(json);
  EXPECT_EQ(capture.frames[0].picture, "images/a.png");
  EXPECT_EQ(capture.frames[0].mask, "mask.png");
  EXPECT_EQ(capture.geometry, "mesh.ply");
  json["geometry"] = "..\\mesh.ply";
  EXPECT_NE(error(json).find("expected a path inside the capture's folder"), std::string::npos);
  image::writeBytes(folder / "..\\mesh.ply", ""); // a name of its own
  EXPECT_EQ(read(json).geometry, "..\\mesh.ply");
}

TEST_F(CaptureFile, AResponseCurveStandsInForAColorSpace) {
  Json json = full(), curve = Json::array();
  for (int z = 0; z < 256; ++z) curve.push_back(z * 0.5);
  json["response"] = {{"r", curve}, {"g", curve}, {"b", curve}};
  EXPECT_EQ(error(json), "response: found both, expected either color_space or response");
  json.erase("color_space");
  EXPECT_EQ(read(json).response->exposure[1][7], 3.5f);
  Json wrong = json;
  wrong["response"]["b"][9] = 3;
  EXPECT_EQ(error(wrong), "response.b[9]: found 3, expected a number not below the one before it");
  wrong = json;
  wrong["response"]["g"].erase(255);
  EXPECT_EQ(error(wrong), "response.g: found a list of 255, expected 256 exposures");
  wrong = json;
  for (Json& exposure : wrong["response"]["r"]) exposure = 0;
  EXPECT_EQ(error(wrong), "response.r: found 0, expected an exposure above 0 at the end");
  wrong["response"].erase("r");
  EXPECT_EQ(error(wrong), "response.r: found nothing, expected 256 exposures");
  wrong["response"] = 2;
  EXPECT_EQ(error(wrong), "response: found 2, expected an object");
}

TEST_F(CaptureFile, LitAndUnlitFramesDoNotMix) {
  Json json = full();
  json["frames"][1].erase("light");
  EXPECT_EQ(error(json), "frames[1].light: found no light, expected one, as in frames[0]");
}

TEST_F(CaptureFile, ASubsetKeepsWhatItsFramesMean) {
  Json json = full();
  json["frames"].push_back(json["frames"][1]);
  json["frames"][2]["camera"] = "C01";
  json["frames"][2]["light"] = "L00";
  const Capture capture = read(json);
  const Capture part = subset(capture, [](const Frame& frame) { return frame.split == Split::test; });
  ASSERT_EQ(part.frames.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(part.views[part.frames[i].view].identity, capture.views[capture.frames[i + 1].view].identity);
    EXPECT_EQ(part.lights[*part.frames[i].light], capture.lights[*capture.frames[i + 1].light]);
  }
  const Capture one = subset(capture, [](const Frame& frame) { return frame.view == 1; });
  EXPECT_EQ(one.views.size(), 1u);
  EXPECT_EQ(one.lights.size(), 1u);
  EXPECT_EQ(one.frames[0].view, 0u);
}

TEST(CaptureViews, TheMiddleOfTheirAxesIsWhatTheyLookAt) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  const Vec3<double> middle(3, -20, 0.5);
  std::vector<View> views;
  for (int i = 0; i < 12; ++i) {
    const Mat3<double> rotation = Eigen::Quaterniond(unit(random), unit(random), unit(random), unit(random))
                                      .normalized()
                                      .toRotationMatrix();
    const Vec3<double> center = middle + 5 * rotation.row(2).transpose(); // cameras look along -z
    View view;
    view.camera.cameraFromWorld = {rotation, -(rotation * center)};
    views.push_back(view);
  }
  EXPECT_LT((middleOfAxes(views) - middle).norm(), 7e-9);
  EXPECT_EQ(middleOfAxes({}), Vec3<double>::Zero());
}

} // namespace
} // namespace surflect::capture
