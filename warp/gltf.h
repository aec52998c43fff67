// Skinned meshes with their animation from glTF 2.0 files, and meshes alone at rest.
#pragma once

#include "surfel/base/error.h"
#include "surfel/geometry/textured_mesh.h"
#include "warp/gltf_document.h"
#include "warp/skeleton.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace surflect::warp {

struct GltfAnimation {
  std::string name;
  std::vector<Channel> channels; // of the nodes that move the skin
  std::optional<Error> refusal;  // reason why it cannot be played; `channels` is then empty
};

struct GltfFile {
  Skeleton skeleton; // of all meshes with a skin, merged
  std::vector<GltfAnimation> animations;
  uint64_t contentHash = 0; // of the file and of its buffers
};

// Reads .glb, and .gltf with its buffers inside, or in files in its folder or below. Ignores materials,
// cameras, meshes without a skin and their motion, and extensions of these. Errors are: sparse accessors,
// morph targets with a weight and triangle strips of the skin, other required extensions, and a file without
// a skin. Throws Error with the file and the field in its JSON. A fault in an animation does not throw; the
// animation keeps it.
GltfFile readGltf(const std::filesystem::path& path);

struct GltfMesh {
  TexturedMesh mesh;        // normals, tangents, texture coordinates if any part has them, otherwise empty
  uint64_t contentHash = 0; // of the file and of its buffers
};

// All meshes of all nodes, placed by the nodes, in the file's axes; skinned ones in bind pose. Errors as for
// readGltf, but any number of skins is allowed, and they are ignored.
GltfMesh readGltfMesh(const std::filesystem::path& path);

// Animations of a glTF file, as far as they move a skin.

// Animations in the file's order. A fault in an animation does not throw; the animation keeps it.
std::vector<GltfAnimation> readAnimations(GltfDocument& document, const Skeleton& skeleton);

} // namespace surflect::warp
