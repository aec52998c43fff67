// A stage file, and the result of replacing a part of it.
#pragma once

#include "render/stage/stage_file.h"
#include "tests/srf/image/files.h"
#include "tests/support/text.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace surflect::stage::stage_example {

inline const std::string example = R"toml(
transport = "local"
samples = 12
seed = 7
center = [0, 0, 0.5]
[camera]
model = "pinhole"
size = [40, 30]
distance = 5
fov_deg = 30
[views]
turntable = 6
elevations_deg = [-20, 40]
test = 3
[lights]
count = 8
test = 2
irradiance = [3, 2, 1]
[[material]]
name = "clay"
type = "rough_diffuse"
albedo = [0.8, 0.4, 0.2]
roughness = 0.5
[[material]]
name = "steel"
type = "conductor"
color = [0.6, 0.6, 0.5]
alpha = [0, 0]
[[object]]
type = "sphere"
material = "clay"
center = [0, 0, 1]
radius = 0.5
segments = 16
[[object]]
type = "box"
material = "steel"
size = [2, 2, 0.1]
)toml";

// The example, or another text, with something else in it.
inline std::string with(const std::string& from, const std::string& to, const std::string& text = example) {
  return replaced(text, from, to);
}

inline stage::Stage parse(const std::string& text) { return stage::parseStage(text, "stage.toml"); }

// The Error names the file, and what else it says has these parts.
inline void expectError(const std::string& text, const std::vector<std::string>& parts) {
  const std::string line = image::errorOf([&] { parse(text); });
  EXPECT_EQ(line.rfind("stage.toml: ", 0), 0u) << line;
  for (const std::string& part : parts) EXPECT_NE(line.find(part), std::string::npos) << line;
}

} // namespace surflect::stage::stage_example
