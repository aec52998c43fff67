// A mesh that moves, as files: one at rest and one for each key frame.
#pragma once

#include "surfel/geometry/mesh.h"
#include "warp/mesh_field.h"

#include <cstdint>
#include <filesystem>
#include <map>

namespace surflect::warp {

// Meshes in OBJ or PLY of one topology: as many vertices, and the same triangles, as the rest mesh.
class MeshSequence {
public:
  // `frames` is a path with one run of # in its file name, in place of the frame's number, padded with zeros
  // to the length of the run. The files that are there are the keys. `origin` is subtracted from the
  // coordinates of all files. Throws Error where the rest mesh is none, or no file has such a name.
  MeshSequence(const std::filesystem::path& rest, const std::filesystem::path& frames,
               const Vec3<double>& origin = Vec3<double>::Zero());

  // Space as the mesh moves it. Between keys each vertex goes straight; before the first and after the last
  // key the mesh stays. Reads one or two files; throws Error with the file whose topology is another.
  WarpPointer at(double frame) const;

  bool reaches(const Vec3<double>& x) const { return field_.reaches(x); } // as MeshField does
  uint64_t contentHash() const { return hash_; }                          // of all files

private:
  std::vector<Vec3<double>> positionsAt(int key) const;

  Vec3<double> origin_;
  TriangleMesh rest_;
  MeshField field_;
  std::map<int, std::filesystem::path> keys_;
  uint64_t hash_ = 0;
};

} // namespace surflect::warp
