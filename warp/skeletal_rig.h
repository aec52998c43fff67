// Warp by a skeleton: the skin follows the joints, and space near the skin follows the skin.
#pragma once

#include "warp/gltf.h"
#include "warp/mesh_field.h"

#include <filesystem>
#include <string>

namespace surflect::warp {

// A glTF file with one of its animations. At rest the skin is posed by the file's nodes without animation.
// The file's coordinates are those of the scene.
class Rig {
public:
  // Selects the animation by name; "" selects the only one of the file. Throws Error as readGltf does, and
  // for an unknown animation.
  Rig(const std::filesystem::path& path, const std::string& animation);

  // Warp at this many seconds into the animation; before and after it, the pose is constant.
  WarpPointer at(double seconds) const;

  const MeshField& field() const { return field_; }
  uint64_t contentHash() const { return file_.contentHash; }

private:
  GltfFile file_;
  size_t animation_; // index in the file
  MeshField field_;
};

} // namespace surflect::warp
