// Skinned meshes and their animation from glTF 2.0 files; and their meshes alone, at rest.
#pragma once

#include "surfel/base/error.h"
#include "surfel/geometry/textured_mesh.h"
#include "warp/skeleton.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace surflect::warp {

struct GltfAnimation {
  std::string name;
  std::vector<Channel> channels; // of nodes that move the skin
  std::optional<Error> refusal;  // why it cannot be played; there are no channels then
};

struct GltfFile {
  Skeleton skeleton; // all meshes that have a skin, as one
  std::vector<GltfAnimation> animations;
  uint64_t contentHash = 0; // of the file and of the buffers it names
};

// Reads .glb, and .gltf with its buffers inside, or in files in its folder or below. Materials, cameras,
// meshes without a skin and what moves them, and extensions of these are passed over. Of the skin, sparse
// accessors, morph targets with a weight and triangle strips are Errors, as are other required extensions and
// a file without a skin. Throws Error with the file and the field in its JSON; where it is in an animation,
// the animation keeps it.
GltfFile readGltf(const std::filesystem::path& path);

struct GltfMesh {
  TexturedMesh mesh;        // normals, tangents, texture coordinates: where any part has them, else 0
  uint64_t contentHash = 0; // of the file and of the buffers it names
};

// All meshes of all nodes, where the nodes put them, in the file's axes; skinned ones as they are bound. The
// same is an Error as there, but that there may be any number of skins, of which nothing is read.
GltfMesh readGltfMesh(const std::filesystem::path& path);

} // namespace surflect::warp
