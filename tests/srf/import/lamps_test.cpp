#include "srf/import/lamps.h"

#include "srf/import/colmap.h"
#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_formats.h"

#include <gtest/gtest.h>

namespace surflect::importers {
namespace {

std::string matchedText(std::string_view pattern, std::string_view name) {
  const auto found = matched(pattern, name);
  return found ? found->camera + " by " + found->light : "none";
}

TEST(LampPattern, TellsCameraAndLight) {
  EXPECT_EQ(matchedText("{camera}/{light}.jpg", "cam01/L7.jpg"), "cam01 by L7");
  EXPECT_EQ(matchedText("{light}/{camera}.png", "on/c.png"), "c by on");
  EXPECT_EQ(matchedText("{camera}_{light}.jpg", "c1_l2_b.jpg"), "c1 by l2_b"); // the shortest camera
  EXPECT_EQ(matchedText("olat/{camera}/img_{light}.exr", "olat/a b/img_03.exr"), "a b by 03");
  for (const char* const name :
       {"cam01/L7.png", "L7.jpg", "a/b/L7.jpg", "cam01/.jpg", "/L7.jpg", "", "cam01/x/L7.jpg"})
    EXPECT_EQ(matchedText("{camera}/{light}.jpg", name), "none") << name;
  for (const char* const pattern :
       {"", "{camera}", "{light}.jpg", "{camera}{light}", "{camera}/{camera}_{light}"})
    EXPECT_THROW(matched(pattern, "a/b"), Error) << pattern;
}

// Three cameras under two lamps; COLMAP has registered some of the pictures.
class Lamps : public ::testing::Test {
protected:
  void SetUp() override {
    for (int c = 0; c < 3; ++c) {
      cameras.push_back(rig.camera(false));
      for (const char* const light : {"on", "off"})
        writePicture(folder / "images" / ("c" + std::to_string(c)) / (std::string(light) + ".png"));
    }
    image::writeBytes(folder / "lamps.txt", "# towards the lamp\non 0 0 2\noff.png 3 0 0\n");
    options.pattern = "{camera}/{light}.png";
    options.lights = folder / "lamps.txt";
  }
  void registerPicture(const std::string& name, VisionCamera camera) {
    images.push_back({name, "PINHOLE", asColmapModel("PINHOLE", camera).second});
  }
  void writeColmap() const {
    std::filesystem::create_directories(folder / "sparse/0");
    image::writeBytes(folder / "sparse/0/cameras.txt", colmapCamerasText(images));
    image::writeBytes(folder / "sparse/0/images.txt", colmapImagesText(images));
  }
  ForeignCapture lit() const {
    ForeignCapture source = readColmap(folder.path(), {}, false);
    giveLights(source, options);
    return source;
  }
  std::string problem() const {
    try {
      lit();
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  }

  image::TemporaryFolder folder;
  VisionRig rig{7};
  std::vector<VisionCamera> cameras;
  std::vector<ColmapImage> images;
  LampOptions options;
};

TEST_F(Lamps, APictureACameraGivesThePosesOfAll) {
  for (size_t c = 0; c < 3; ++c) registerPicture("c" + std::to_string(c) + "/on.png", cameras[c]);
  writeColmap();
  const ForeignCapture source = lit();
  const capture::Capture& capture = source.capture;
  ASSERT_EQ(capture.views.size(), 3u);
  ASSERT_EQ(capture.frames.size(), 6u);
  ASSERT_EQ(capture.lights.size(), 2u);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(capture.views[c].identity, "c" + std::to_string(c));
    rig.expectSamePixels(capture.views[c].camera, cameras[c]);
  }
  for (const capture::Frame& frame : capture.frames)
    EXPECT_EQ(frame.picture, folder / "images" / capture.views[frame.view].identity /
                                 (capture.lights[*frame.light].name + ".png"));
  const auto& on = std::get<capture::DirectionalLight>(capture.lights[0].kind);
  EXPECT_EQ(capture.lights[0].name, "on");
  EXPECT_EQ(on.towards.raw(), Vec3<double>(0, 0, 1));
  EXPECT_EQ(capture.lights[1].name, "off"); // the table names the picture
}

TEST_F(Lamps, ATableSaysWhatItWasTakenFor) {
  for (size_t c = 0; c < 3; ++c) registerPicture("c" + std::to_string(c) + "/on.png", cameras[c]);
  writeColmap();
  const auto told = [&] {
    std::string all;
    for (const std::string& note : lit().notes) all += note + "\n";
    return all;
  };
  EXPECT_NE(told().find("lamps are directions of lengths 2 to 3; if they are places: --positions"),
            std::string::npos)
      << told();
  options.positions = true;
  EXPECT_NE(told().find(" from the point that the cameras look at, and cameras "), std::string::npos);
  options.positions = false;
  image::writeBytes(folder / "lamps.txt", "on 0 0 1\noff 1 0 0\n");
  EXPECT_EQ(told().find("lamps "), std::string::npos) << told();
}

TEST_F(Lamps, PosesOfSeveralRegisteredPicturesAreAveraged) {
  std::vector<VisionCamera> shaken;
  for (const double turn : {-0.01, 0.01}) {
    VisionCamera camera = cameras[0];
    camera.rotation = Eigen::AngleAxisd(turn, Vec3<double>(1, 2, 3).normalized()) * camera.rotation;
    camera.translation = camera.rotation * (cameras[0].rotation.inverse() * cameras[0].translation);
    shaken.push_back(camera);
  }
  registerPicture("c0/on.png", shaken[0]);
  registerPicture("c0/off.png", shaken[1]);
  writeColmap();
  const ForeignCapture source = lit();
  ASSERT_EQ(source.capture.views.size(), 1u);
  EXPECT_EQ(source.capture.frames.size(), 2u);
  const auto pose = source.capture.views[0].camera.cameraFromWorld;
  const Mat3<double> axes = Vec3<double>(1, -1, -1).asDiagonal(); // ours from computer vision's
  EXPECT_LT((pose.rotation() - axes * cameras[0].rotation.toRotationMatrix()).norm(), 7e-16);
  const auto says = [&](const char* words) {
    return std::ranges::any_of(source.notes,
                               [&](const std::string& note) { return note.find(words) != note.npos; });
  };
  EXPECT_TRUE(says("1 camera with several registered pictures"));
  EXPECT_TRUE(says("4 pictures left out, of cameras without a registered picture"));
}

TEST_F(Lamps, AFlashIsWhereTheCameraCarriesIt) {
  for (size_t c = 0; c < 3; ++c) registerPicture("c" + std::to_string(c) + "/on.png", cameras[c]);
  writeColmap();
  options = {.flash = Vec3<double>(0.2, 0.1, -0.05)};
  const ForeignCapture source = lit();
  ASSERT_EQ(source.capture.lights.size(), 3u);
  for (const capture::Frame& frame : source.capture.frames) {
    const auto& flash = std::get<capture::PointLight>(source.capture.lights[*frame.light].kind);
    const auto seen = source.capture.views[frame.view].camera.cameraFromWorld(flash.position);
    EXPECT_LT((seen.raw() - *options.flash).norm(), 6e-15);
    EXPECT_NEAR(flash.intensity.r, 25, 4); // the object is about 5 away
  }
}

TEST_F(Lamps, TakeThePlaceOfListedOnesThatNoPhotographNames) {
  for (size_t c = 0; c < 3; ++c) registerPicture("c" + std::to_string(c) + "/on.png", cameras[c]);
  writeColmap();
  for (const bool isFlash : {true, false}) {
    ForeignCapture source = readColmap(folder.path(), {}, false);
    source.capture.lights.push_back({"listed", "listed", capture::DirectionalLight{{0, 0, 1}, {1, 1, 1}}});
    if (isFlash)
      giveLights(source, {.flash = Vec3<double>(0.2, 0.1, -0.05)});
    else
      giveLights(source, options);
    ASSERT_EQ(source.capture.lights.size(), isFlash ? 3u : 2u);
    for (const capture::Frame& frame : source.capture.frames) {
      const std::string name = source.capture.lights[*frame.light].name;
      if (isFlash)
        EXPECT_EQ(name, "flash " + source.capture.views[frame.view].identity);
      else
        EXPECT_EQ(name, frame.picture.stem().string());
    }
  }
}

TEST_F(Lamps, StandWhereRegisteredPicturesWereTaken) {
  for (size_t c = 0; c < 3; ++c) registerPicture("c" + std::to_string(c) + "/on.png", cameras[c]);
  std::vector<VisionCamera> lamps{rig.camera(false), rig.camera(false)};
  registerPicture("lamp_on.png", lamps[0]);
  registerPicture("lamp_off.png", lamps[1]);
  for (const char* const name : {"lamp_on.png", "lamp_off.png"}) writePicture(folder / "images" / name);
  writeColmap();
  options = {.pattern = "{camera}/{light}.png", .lampImages = "lamp_{light}.png"};
  const ForeignCapture source = lit();
  EXPECT_EQ(source.capture.views.size(), 3u);
  EXPECT_EQ(source.capture.frames.size(), 6u);
  ASSERT_EQ(source.capture.lights.size(), 2u);
  for (const capture::Light& light : source.capture.lights) {
    const VisionCamera& at = lamps[light.name == "on" ? 0 : 1];
    const Vec3<double> center = -(at.rotation.inverse() * at.translation);
    EXPECT_LT((std::get<capture::PointLight>(light.kind).position.raw() - center).norm(), 1e-12)
        << light.name;
  }
  options.lampImages = "lamp_{light}.jpg";
  EXPECT_NE(problem().find(
                "--lamp-images: found \"lamp_{light}.jpg\", expected the names of some registered pictures"),
            std::string::npos)
      << problem();
  for (const char* const pattern : {"lamp.png", "{light}_{light}.png", "{camera}_{light}.png"}) {
    options.lampImages = pattern;
    EXPECT_NE(problem().find("expected {light}, once, and no {camera}"), std::string::npos) << problem();
  }
}

TEST_F(Lamps, AreNamedByFolders) {
  for (const char* const light : {"on", "off"}) writePicture(folder / "images" / light / "c0.png");
  registerPicture("on/c0.png", cameras[0]);
  writeColmap();
  options.pattern = "{light}/{camera}.png";
  const ForeignCapture source = lit();
  EXPECT_EQ(source.capture.views.size(), 1u);
  EXPECT_EQ(source.capture.frames.size(), 2u);
}

TEST_F(Lamps, MistakesAreNamed) {
  registerPicture("c0/on.png", cameras[0]);
  writeColmap();
  options.pattern = "{camera}-{light}.png";
  EXPECT_NE(
      problem().find(
          "--pattern: found \"{camera}-{light}.png\", expected names of pictures such as \"c0/on.png\""),
      std::string::npos)
      << problem();
  options.pattern = "{camera}/{light}.png";
  image::writeBytes(folder / "lamps.txt", "on 0 0 1\n");
  EXPECT_NE(problem().find("picture \"c0/off.png\": found \"off\", expected a light of"), std::string::npos)
      << problem();
  image::writeBytes(folder / "lamps.txt", "on 0 0 1\non 0 1 0\n");
  EXPECT_NE(problem().find("lamps.txt: line 2: light \"on\" is listed twice"), std::string::npos)
      << problem();
  image::writeBytes(folder / "lamps.txt", "on 0 0 1\noff 0 0 0\n");
  EXPECT_NE(problem().find("line 2: found 0 0 0, expected a direction"), std::string::npos) << problem();
  options.lights.clear();
  EXPECT_NE(problem().find("--lights"), std::string::npos);
}

TEST_F(Lamps, TheImportedFolderIsALitCapture) {
  for (size_t c = 0; c < 3; ++c) registerPicture("c" + std::to_string(c) + "/on.png", cameras[c]);
  writeColmap();
  const ImportReport report = importCapture(folder.path(), folder / "out", {.lamps = options});
  EXPECT_EQ(report.format, ImportFormat::colmap);
  EXPECT_EQ(std::tuple(report.views, report.lights, report.trainingFrames), std::tuple(3u, 2u, 6u));
  const capture::Capture capture = capture::readCapture(folder / "out");
  EXPECT_EQ(capture.frames.size(), 6u);
  for (size_t c = 0; c < 3; ++c) rig.expectSamePixels(capture.views[c].camera, cameras[c]);
}

} // namespace
} // namespace surflect::importers
