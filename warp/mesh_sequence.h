// An animated mesh in files: one at rest and one per key frame.
#pragma once

#include "surfel/geometry/mesh.h"
#include "warp/mesh_field.h"

#include <cstdint>
#include <filesystem>
#include <map>

namespace surflect::warp {

// Meshes in OBJ or PLY of one topology: the same number of vertices and the same triangles as the rest mesh.
class MeshSequence {
public:
  // `frames` is a path whose file name has one run of #, which stands for the frame number, padded with zeros
  // to the run's length. Existing files are the keys. `origin` is subtracted from the coordinates of all
  // files. Reads all keys, so that a film stops before its first frame. Throws Error if the rest mesh is
  // invalid, no file has such a name, or with the file that is invalid or whose topology differs.
  MeshSequence(const std::filesystem::path& rest, const std::filesystem::path& frames,
               const Vec3<double>& origin = Vec3<double>::Zero());

  // Warp by the mesh at a frame. Vertices move linearly between keys; before the first key and after the
  // last, the mesh does not move. Reads one or two files; throws Error if they have changed.
  WarpPointer at(double frame) const;

  const MeshField& field() const { return field_; }
  uint64_t contentHash() const { return hash_; } // of all files

private:
  std::vector<Vec3<double>> positionsAt(int key) const;

  Vec3<double> origin_;
  TriangleMesh rest_;
  MeshField field_;
  std::map<int, std::filesystem::path> keys_;
  uint64_t hash_ = 0;
};

} // namespace surflect::warp
