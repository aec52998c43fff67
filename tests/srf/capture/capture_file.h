// A folder with a capture, for tests of how its file is read.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <sstream>
#include <string>

namespace surflect::capture::testing {

using Json = nlohmann::json;

inline const Json identityPose = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 5}, {0, 0, 0, 1}};

class CaptureFile : public ::testing::Test {
protected:
  CaptureFile() {
    std::filesystem::create_directory(folder / "images");
    image::writePng(folder / "images/a.png", image::Image(6, 4, 3));
    image::writeExr(folder / "images/b.exr", image::Image(8, 2, 3));
    image::writePng(folder / "mask.png", image::Image(6, 4, 1));
    image::writeBytes(folder / "mesh.ply", "");
    image::writePng(folder.path().string() + "-outside.png", image::Image(6, 4, 3));
  }
  ~CaptureFile() override { std::filesystem::remove(folder.path().string() + "-outside.png"); }

  // Says everything that can be said.
  static Json full() {
    return {{"color_space", "srgb"},
            {"geometry", "mesh.ply"},
            {"camera_model", "pinhole"},
            {"w", 6},
            {"h", 4},
            {"fl_x", 10.5},
            {"fl_y", 11.5},
            {"cx", 3.25},
            {"cy", 1.75},
            {"k1", 0.01},
            {"k2", 0.02},
            {"k3", 0.005},
            {"p1", 0.03},
            {"p2", 0.04},
            {"lights",
             {{{"name", "L00"},
               {"type", "directional"},
               {"direction", {0, 0.6, 0.8}},
               {"irradiance", {1, 2, 3}},
               {"irradiance_gradient", {0.1, -0.2, 0.3}}},
              {{"name", "P01"},
               {"type", "point"},
               {"position", {1, 2, 3}},
               {"intensity", {4, 5, 6}},
               {"cluster", "L00"}}}},
            {"frames",
             {{{"file_path", "images/a.png"},
               {"transform_matrix", identityPose},
               {"camera", "C00"},
               {"light", "L00"},
               {"layer", ""},
               {"alpha_layer", ""},
               {"exposure", 0.5},
               {"mask_path", "mask.png"},
               {"split", "train"}},
              {{"file_path", "images/b.exr"},
               {"layer", "Combined_P01"},
               {"alpha_layer", "Combined"},
               {"transform_matrix", identityPose},
               {"camera", "C00"},
               {"light", "P01"},
               {"split", "test"}}}}};
  }
  // Says as little as possible: fixed light, as nerfstudio and Blender write it.
  static Json small() {
    return {{"camera_angle_x", 0.5},
            {"frames", {{{"file_path", "./images/a"}, {"transform_matrix", identityPose}}}}};
  }

  Capture read(const Json& json) const { return readText(json.dump()); }
  Capture readText(const std::string& text) const {
    image::writeBytes(folder / "transforms.json", text);
    return readCapture(folder.path());
  }
  // The line of the Error, after the file's name.
  std::string error(const Json& json) const {
    const std::string line = image::errorOf([&] { read(json); }),
                      file = (folder / "transforms.json").string() + ": ";
    EXPECT_TRUE(line.starts_with(file)) << line;
    return line.substr(std::min(file.size(), line.size()));
  }

  image::TemporaryFolder folder;
};

// "frames[0].light" for "/frames/0/light".
inline std::string fieldOf(std::string pointer) {
  std::string field;
  for (std::stringstream steps(pointer.erase(0, 1)); std::getline(steps, pointer, '/');)
    field += std::isdigit(static_cast<unsigned char>(pointer[0])) ? "[" + pointer + "]"
                                                                  : (field.empty() ? "" : ".") + pointer;
  return field;
}

} // namespace surflect::capture::testing
