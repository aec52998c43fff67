// The file of a scene of light field maps:
//
//   [[object]]
//   model = "vase.lfm"        # folder, from the file's own
//   position = [1, 0, 0]      # of the model's origin; default 0
//   rotate_axis = [0, 0, 1]   # default z
//   rotate_deg = 30           # default 0
//   scale = 0.5               # default 1
#pragma once

#include "render/lightfield/lfm/joined.h"

#include <filesystem>
#include <string_view>
#include <vector>

namespace surflect::lfm {

struct SceneFile {
  std::vector<std::filesystem::path> models; // without repetition
  std::vector<PlacedObject> objects;         // at least one
};

// Both throw Error naming file and field.
SceneFile parseSceneFile(std::string_view text, const std::filesystem::path& path);
SceneFile readSceneFile(const std::filesystem::path& path);

} // namespace surflect::lfm
