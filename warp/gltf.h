// Skinned meshes and their animation from glTF 2.0 files.
#pragma once

#include "warp/skeleton.h"

#include <filesystem>
#include <string>
#include <vector>

namespace surflect {

struct GltfAnimation {
  std::string name;
  std::vector<Channel> channels;
};

struct GltfFile {
  Skeleton skeleton; // all meshes that have a skin, as one
  std::vector<GltfAnimation> animations;
  uint64_t contentHash = 0; // of the file and of the buffers it names
};

// Reads .glb, and .gltf with its buffers inside, or in files in its folder or below. Materials, cameras and
// meshes without a skin are passed over; sparse accessors, morph targets, triangle strips and required
// extensions are Errors, as is a file without a skin. Throws Error with the file and the field in its JSON.
GltfFile readGltf(const std::filesystem::path& path);

} // namespace surflect
