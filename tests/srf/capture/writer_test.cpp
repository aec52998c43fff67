#include "srf/capture/writer.h"

#include "srf/image/png.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

#include <cmath>
#include <limits>
#include <sstream>

namespace surflect::capture {
namespace {

std::string numbered(std::string prefix, int number) { return prefix.append(std::to_string(number)); }

class Writer : public ::testing::Test {
protected:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  float positive() { return static_cast<float>(uniform(0.1, 10)); }

  Light light(int index) {
    const std::string name = numbered("L", index);
    const Vec3<double> v(uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1));
    if (index % 2)
      return {name, name,
              DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(v.normalized()),
                               {positive(), positive(), positive()},
                               index % 4 == 1 ? Vec3<double>(uniform(-1, 1), uniform(-1, 1), 0.1)
                                              : Vec3<double>(0, 0, 0)}};
    return {name, "shared", PointLight{assume<Point3<AcquisitionSpace, double>>(v), {positive(), 1, 0.3f}}};
  }
  View view(int index, bool oneLens) {
    const Eigen::Quaterniond q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    Lens lens{Lens::Model::pinhole, 6, 4, 9.1, 9.7, 3.3, 1.9, 0.1, 0.02, 0.003, 0.0004, 0.005};
    if (!oneLens && index % 2) lens = {Lens::Model::orthographic, 6, 4, 8, 8, 3, 2};
    if (!oneLens) lens.centerX = uniform(2, 4);
    return {numbered("C", index / 2), {lens, {q.normalized().toRotationMatrix(), {uniform(-5, 5), 1, 2}}}};
  }
  Capture anyCapture(bool oneLens) {
    Capture capture;
    capture.colorSpace = ColorSpace::linear;
    capture.geometry = "mesh.ply";
    capture.calibration = {{"light_strengths", "estimated by \"hand\""}};
    for (int l = 0; l < 5; ++l) capture.lights.push_back(light(l));
    for (int v = 0; v < 6; ++v) capture.views.push_back(view(v, oneLens));
    for (size_t v = 0; v < 6; ++v)
      for (size_t l = 0; l < 5; ++l)
        capture.frames.push_back(
            {v, l, "a.png", numbered("Layer_", static_cast<int>(l)), l % 2 ? "Layer" : "", uniform(0.1, 9),
             v % 2 ? "mask.png" : "", l == 4 ? Split::test : Split::train,
             l == 3 ? std::vector<Exposure>{{"a.png", "", "", 0.01}, {"mask.png", "x", "y", 1}}
                    : std::vector<Exposure>{}});
    return capture;
  }

  image::TemporaryFolder folder;
  std::mt19937 random{1};
};

TEST_F(Writer, WhatIsWrittenIsReadBackEqual) {
  for (const char* name : {"a.png", "mask.png", "mesh.ply"}) image::writeBytes(folder / name, "");
  for (const bool oneLens : {true, false}) {
    Capture capture = anyCapture(oneLens);
    std::get<DirectionalLight>(capture.lights[1].kind).irradiance = {1e-12f, 1, 1e12f}; // as far as they go
    if (!oneLens) {
      capture.colorSpace.reset();
      for (auto& curve : capture.response.emplace().exposure)
        for (size_t z = 1; z < curve.size(); ++z) curve[z] = curve[z - 1] + 0.1f * positive();
    }
    writeCapture(capture, folder.path());
    const Capture back = readCapture(folder.path());
    EXPECT_EQ(back.file, folder / "transforms.json");
    EXPECT_EQ(back.colorSpace, capture.colorSpace);
    EXPECT_EQ(back.response, capture.response);
    EXPECT_EQ(back.geometry, capture.geometry);
    EXPECT_EQ(back.calibration, capture.calibration);
    EXPECT_EQ(back.lights, capture.lights);
    EXPECT_EQ(back.frames, capture.frames);
    ASSERT_EQ(back.views.size(), capture.views.size());
    for (size_t v = 0; v < capture.views.size(); ++v) {
      EXPECT_EQ(back.views[v].identity, capture.views[v].identity);
      EXPECT_EQ(back.views[v].camera.lens, capture.views[v].camera.lens);
      const auto &got = back.views[v].camera.cameraFromWorld,
                 &wanted = capture.views[v].camera.cameraFromWorld;
      EXPECT_NEAR((got.rotation() - wanted.rotation()).norm(), 0, 1e-15);
      EXPECT_NEAR((got.translation() - wanted.translation()).norm(), 0, 1e-14);
    }
  }
}

TEST_F(Writer, FixedIlluminationStaysFixed) {
  image::writeBytes(folder / "a.png", "");
  Capture capture = anyCapture(true);
  capture.lights.clear();
  capture.colorSpace.reset();
  capture.geometry.clear();
  capture.frames = {{.view = 0, .picture = "a.png"}, {.view = 1, .picture = "a.png"}};
  capture.views.resize(2);
  writeCapture(capture, folder.path());
  const Capture back = readCapture(folder.path());
  EXPECT_EQ(back.frames, capture.frames);
  EXPECT_EQ(back.colorSpace, std::nullopt);
  EXPECT_TRUE(back.lights.empty() && back.geometry.empty());
}

TEST_F(Writer, NamesThatAreNotUtf8AreRefused) {
  Capture capture = anyCapture(true);
  capture.frames[3].picture = "caf\xe9.png";
  EXPECT_NE(image::errorOf([&] { writeCapture(capture, folder.path()); }).find("caf\\xe9.png is not UTF-8"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(Writer, WhatIsNotFiniteIsRefusedByItsField) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), far = std::numeric_limits<double>::infinity();
  const auto refusal = [&](auto spoil) {
    Capture capture = anyCapture(true);
    spoil(capture);
    const std::string line = image::errorOf([&] { writeCapture(capture, folder.path()); }),
                      file = (folder / "transforms.json").string() + ": ";
    EXPECT_TRUE(line.starts_with(file)) << line;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    return line.substr(std::min(file.size(), line.size()));
  };
  EXPECT_EQ(refusal([&](Capture& c) {
              for (View& view : c.views) view.camera.lens.centerX = far;
            }),
            "cx: found inf, expected a finite number");
  EXPECT_EQ(
      refusal([&](Capture& c) { std::get<DirectionalLight>(c.lights[1].kind).irradiance.g = HUGE_VALF; }),
      "lights[1].irradiance[1]: found inf, expected a finite number");
  EXPECT_EQ(refusal([&](Capture& c) { c.frames[2].exposure = -far; }),
            "frames[2].exposure: found -inf, expected a finite number");
  EXPECT_TRUE(refusal([&](Capture& c) {
                c.views[0].camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(0, 0, nan)};
              }).starts_with("frames[0].transform_matrix["));
}

TEST_F(Writer, EveryPictureHasItsOwnLine) {
  const Capture capture = anyCapture(true);
  writeCapture(capture, folder.path());
  std::istringstream text(readFile(folder / "transforms.json"));
  size_t lines = 0, pictures = 0;
  for (std::string line; std::getline(text, line);) lines += line.starts_with("  {\"file_path\":");
  for (const Frame& frame : capture.frames) pictures += bracketOf(frame).size();
  EXPECT_EQ(lines, pictures);
}

} // namespace
} // namespace surflect::capture
