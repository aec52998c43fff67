// An animated mesh in files: one at rest, and its keys in one file each or in a point cache.
#pragma once

#include "surfel/geometry/mesh.h"
#include "warp/mesh_field.h"
#include "warp/point_cache.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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
  // Keys from a point cache, whose points are the vertices of the rest mesh in their order. Throws Error as
  // PointCache does, and if the first sample is the rest mesh in other axes.
  static MeshSequence ofCache(const std::filesystem::path& rest, const std::filesystem::path& cache);

  // Warp by the mesh at a frame of files and PC2, at a second of MDD. Vertices move linearly between keys;
  // before the first key and after the last, the mesh does not move. Reads one or two keys; throws Error if
  // their files have changed.
  WarpPointer at(double time) const;

  // The cache's format; empty for files.
  std::optional<PointCache::Format> cacheFormat() const {
    return cache_ ? std::optional(cache_->format()) : std::nullopt;
  }

  // How a cache's first sample differs from the rest mesh if it is that mesh in another place, such as
  // "turned by 30.0 degrees, moved by 1.5": exporters may write an object's own coordinates.
  const std::optional<std::string>& displacement() const { return displacement_; }

  const MeshField& field() const { return field_; }
  uint64_t contentHash() const { return hash_; } // of all files

private:
  MeshSequence(const std::filesystem::path& rest, const Vec3<double>& origin);
  std::vector<Vec3<double>> positionsAt(size_t key) const;

  Vec3<double> origin_;
  TriangleMesh rest_;
  MeshField field_;
  std::vector<double> times_;                // of the keys
  std::vector<std::filesystem::path> files_; // of the keys, unless they are in the cache
  std::optional<PointCache> cache_;
  std::optional<std::string> displacement_;
  uint64_t hash_ = 0;
};

} // namespace surflect::warp
