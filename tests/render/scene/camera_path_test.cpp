#include "render/scene/camera_path.h"

#include "render/scene/scene.h"
#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <array>

namespace surflect::scene {
namespace {

struct Pose {
  Mat3<double> worldFromCamera;
  Vec3<double> position;
};

std::string matrixText(const Pose& pose) {
  std::string text = "[";
  for (int row = 0; row < 3; ++row) {
    text += '[';
    for (int column = 0; column < 3; ++column)
      text += fmt::format("{:.17g}, ", pose.worldFromCamera(row, column));
    text += fmt::format("{:.17g}], ", pose.position[row]);
  }
  return text + "[0, 0, 0, 1]]";
}

class CameraPathTest : public ::testing::Test {
protected:
  CameraPath read(const std::string& text, const Vec3<double>& origin = Vec3<double>::Zero()) const {
    image::writeBytes(folder / "camera.json", text);
    return CameraPath(folder / "camera.json", origin);
  }
  std::string complaint(const std::string& text) const {
    const std::string line = image::errorOf([&] { read(text); });
    return line.substr(line.find("camera.json"));
  }
  std::string path(const std::string& frames) const {
    return R"({"w": 64, "h": 48, "fl_x": 100, "frames": [)" + frames + "]}";
  }
  std::string key(double frame, const std::string& more = "") const {
    return fmt::format(R"({{"frame": {}, "transform_matrix": {}{}}})", frame, matrixText(pose), more);
  }

  image::TemporaryFolder folder;
  Pose pose{Mat3<double>::Identity(), {1, 2, 3}};
};

// A path by examples/blender/surflect_export.py from Blender 3.4, of a turning and zooming camera with lens
// shifts and a scaled object. Pixels are by Blender's own world_to_camera_view, in single precision.
TEST_F(CameraPathTest, ProjectsAsBlenderDoes) {
  const CameraPath path = read(R"({"w": 64, "h": 48, "frames": [
          {"frame": 1, "fl_x": 71.11111111111111, "fl_y": 71.11111111111111, "cx": 28.799999952316284, "cy": 17.59999990463257, "transform_matrix": [
            [0.618504524230957, -0.30000796914100647, 0.7262557744979858, 4.0],
            [0.7794135808944702, 0.3516542315483093, -0.518511176109314, -3.0],
            [-0.09983343631029129, 0.8867550492286682, 0.4513299763202667, 2.0],
            [0.0, 0.0, 0.0, 1.0]]},
          {"frame": 2, "fl_x": 88.88888888888889, "fl_y": 88.88888888888889, "cx": 28.799999952316284, "cy": 17.59999990463257, "transform_matrix": [
            [0.7316888570785522, -0.33916375041007996, 0.591269314289093, 3.5],
            [0.6816388368606567, 0.36406707763671875, -0.6346839666366577, -3.5],
            [7.514464073210547e-08, 0.8674232959747314, 0.4975709617137909, 2.25],
            [0.0, 0.0, 0.0, 1.0]]},
          {"frame": 3, "fl_x": 106.66666666666667, "fl_y": 106.66666666666667, "cx": 28.799999952316284, "cy": 17.59999990463257, "transform_matrix": [
            [0.8212123513221741, -0.37441152334213257, 0.4306114912033081, 3.0],
            [0.5618216395378113, 0.3984968364238739, -0.7249529361724854, -4.0],
            [0.09983338415622711, 0.8372671604156494, 0.5376030206680298, 2.5],
            [0.0, 0.0, 0.0, 1.0]]}]})");
  struct Seen {
    double frame;
    Vec3<double> point;
    double x, y;
  };
  const std::array<Seen, 6> all{{{1, {0, 0, 0}, 29.64710807800293, 11.215973854064941},
                                 {1, {0.5, -0.7, 0.3}, 25.602840423583984, 12.04995059967041},
                                 {2, {0, 0, 0}, 25.921979904174805, 9.227502822875977},
                                 {2, {0.5, -0.7, 0.3}, 23.167688369750977, 10.809176445007324},
                                 {3, {0, 0, 0}, 19.82190704345703, 5.5750837326049805},
                                 {3, {0.5, -0.7, 0.3}, 19.19979476928711, 8.219298362731934}}};
  for (const Seen& seen : all) {
    const auto pixel = path.at(seen.frame).project(assume<Point3<ObjectSpace, double>>(seen.point));
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x, seen.x, 2e-5);
    EXPECT_NEAR(pixel->y, seen.y, 2e-5);
  }
}

TEST_F(CameraPathTest, ALensMayDistortAndItsDistortionMovesBetweenKeys) {
  const CameraPath path = read(R"({"w": 64, "h": 48, "fl_x": 100, "k1": 0.1, "p2": 0.02, "frames": [)" +
                               key(1) + "," + key(3, R"(, "k1": 0.3, "k3": -0.5)") + "]}");
  EXPECT_EQ(path.at(1).lens.k1, 0.1);
  EXPECT_EQ(path.at(3).lens.k1, 0.3);
  EXPECT_NEAR(path.at(2).lens.k1, 0.2, 1e-15);
  EXPECT_EQ(path.at(2).lens.k3, -0.25);
  EXPECT_NEAR(path.at(2.5).lens.p2, 0.02, 1e-15);
}

TEST_F(CameraPathTest, AnOrthographicCameraKeepsItsModel) {
  const std::string start = R"({"w": 64, "h": 48, "camera_model": "orthographic", "frames": [)";
  const CameraPath path =
      read(start + key(1, R"(, "ortho_height": 2)") + "," + key(3, R"(, "ortho_height": 4)") + "]}");
  EXPECT_EQ(path.at(2).lens.model, capture::Lens::Model::orthographic);
  EXPECT_EQ(path.at(1).lens.focalY, 24);
  EXPECT_EQ(path.at(3).lens.focalY, 12);
  EXPECT_EQ(complaint(start + key(1, R"(, "ortho_height": 2)") + "," +
                      key(3, R"(, "camera_model": "pinhole", "fl_x": 100)") + "]}"),
            "camera.json: frames[1].camera_model: found another, expected that of the first key");
}

TEST_F(CameraPathTest, KeysAreMetExactlyAndHeldOutside) {
  std::string frames;
  std::mt19937 random(1);
  std::normal_distribution<double> any;
  std::vector<Pose> poses;
  for (int i = 0; i < 5; ++i) {
    pose = {Eigen::Quaterniond(any(random), any(random), any(random), any(random))
                .normalized()
                .toRotationMatrix(),
            {any(random), any(random), any(random)}};
    poses.push_back(pose);
    frames += (i > 0 ? ", " : "") + key(2 * i + 1, fmt::format(R"(, "fl_x": {}, "cx": {})", 100 + i, 30 + i));
  }
  const CameraPath camera = read(path(frames));
  for (int i = -1; i <= 5; ++i) {
    const auto at = camera.at(2 * i + 1);
    const int held = std::clamp(i, 0, 4);
    const Pose& wanted = poses[static_cast<size_t>(held)];
    EXPECT_LT((at.center().raw() - wanted.position).norm(), 2e-15);
    EXPECT_LT((at.cameraFromWorld.rotation().transpose() - wanted.worldFromCamera).norm(), 2e-15);
    EXPECT_EQ(at.lens.focalX, 100 + held);
    EXPECT_EQ(at.lens.focalY, 100 + held);
    EXPECT_EQ(at.lens.centerX, 30 + held);
    EXPECT_EQ(at.lens.centerY, 24);
  }
}

// Between two keys: a straight line at constant speed, and a turn about one axis at constant speed.
TEST_F(CameraPathTest, TurnsAboutOneAxisBetweenKeys) {
  const Vec3<double> axis = Vec3<double>(1, -2, 0.5).normalized();
  const Mat3<double> first = Eigen::AngleAxisd(1.3, Vec3<double>::UnitZ()).toRotationMatrix();
  const auto turnedBy = [&](double angle) -> Mat3<double> {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix() * first;
  };
  pose = {turnedBy(0), {1, 0, 0}};
  std::string frames = key(10);
  pose = {turnedBy(2), {5, 4, -4}};
  frames += ", " + key(14, R"(, "fl_x": 300)");
  const CameraPath camera = read(path(frames));
  for (const double share : {0.125, 0.25, 0.5, 0.9}) {
    const auto at = camera.at(10 + 4 * share);
    EXPECT_LT((at.center().raw() - Vec3<double>(1 + 4 * share, 4 * share, -4 * share)).norm(), 9e-15);
    EXPECT_LT((at.cameraFromWorld.rotation().transpose() - turnedBy(2 * share)).norm(), 2e-15);
    EXPECT_NEAR(at.lens.focalX, 100 + 200 * share, 1e-13);
  }
}

TEST_F(CameraPathTest, PlacesAreRelativeToTheOrigin) {
  const CameraPath camera = read(path(key(1)), {1000, -2000, 500});
  EXPECT_LT((camera.at(1).center().raw() - Vec3<double>(-999, 2002, -497)).norm(), 1e-12);
}

TEST_F(CameraPathTest, WhatIsWrongIsNamed) {
  const auto complains = [&](const std::string& text, const std::string& of) {
    EXPECT_NE(complaint(text).find(of), std::string::npos) << complaint(text);
  };
  complains("{", "camera.json: ");
  complains(path(""), "frames: found none, expected one or more");
  complains(path(key(1) + ", " + key(1)), "frames[1].frame: found 1, expected more than 1");
  complains(path(key(1, R"(, "fl_z": 3)")), "frames[0].fl_z: unknown key; did you mean fl_");
  complains(R"({"w": 64, "h": 48, "fl_x": 100, "frame": []})", "frame: unknown key; did you mean frames?");
  complains(R"({"h": 48, "fl_x": 100, "frames": [)" + key(1) + "]}", "w: found nothing");
  complains(R"({"w": 64, "h": 48, "frames": [)" + key(1) + "]}", "frames[0].fl_x: found nothing");
  complains(path(R"({"frame": 1})"), "frames[0].transform_matrix: found nothing");
  complains(path(R"({"frame": 1e999, "transform_matrix": []})"), "camera.json: ");
  pose.worldFromCamera(0, 0) = -1;
  complains(path(key(1)), "frames[0].transform_matrix: found a reflection");
}

TEST_F(CameraPathTest, AScriptFindsItsCameraAndHashesIt) {
  const std::string text =
      "[output]\nsize = [32, 24]\npath = \"f.#.exr\"\n[camera]\nfile = \"camera.json\"\n";
  read(path(key(1)));
  const Script script = parseScript(text, folder / "film.toml");
  const auto camera = cameraAt(script, shotTime(script, 1));
  EXPECT_EQ(camera.lens.width, 32);
  EXPECT_EQ(camera.lens.focalX, 50); // of the smaller picture
  read(path(key(2)));
  EXPECT_NE(parseScript(text, folder / "film.toml").hash, script.hash);
  EXPECT_NE(image::errorOf([&] {
              const Script wide =
                  parseScript(std::string(text).replace(text.find("32"), 2, "99"), folder / "film.toml");
              cameraAt(wide, shotTime(wide, 1));
            }).find("output.size: found 99 x 24, expected the shape of the camera file's pictures, 64 x 48"),
            std::string::npos);
  EXPECT_NE(image::errorOf([&] {
              parseScript(text + "fov_deg = 3\n", folder / "film.toml");
            }).find("camera.file: "),
            std::string::npos);
}

} // namespace
} // namespace surflect::scene
