// A skeleton that moves space: the skin follows the joints, and what is near the skin follows the skin.
#pragma once

#include "warp/gltf.h"
#include "warp/mesh_field.h"

#include <filesystem>
#include <string>

namespace surflect::warp {

// A glTF file with one of its animations. At rest is the skin as the nodes of the file have it when no
// animation moves them; the file's coordinates are those of the scene.
class Rig {
public:
  // The animation of this name; "" is the only one. Throws Error as readGltf does, and where there is no such
  // animation.
  Rig(const std::filesystem::path& path, const std::string& animation);

  // Space as the joints move it that many seconds into the animation; before and after, it stays.
  WarpPointer at(double seconds) const;

  bool reaches(const Vec3<double>& x) const { return field_.reaches(x); } // as MeshField does
  uint64_t contentHash() const { return file_.contentHash; }

private:
  GltfFile file_;
  size_t animation_; // of the file's
  MeshField field_;
};

} // namespace surflect::warp
