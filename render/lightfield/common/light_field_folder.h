// Folder of a light field on disk, of any format:
//
//   manifest.json     format, version, numbers and counts, checksums of the other files; written last
//   transforms.json   the training views that the light field was built from, in its coordinates
//   mesh.bin          the triangle mesh, exactly
//   others            the format's own
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace surflect::lightfield {

// Numbers of a light field by name; counts are whole.
using Numbers = std::map<std::string, double>;

// Throws Error unless a light field may be written there: the folder is missing, empty, or holds one.
void requireLightFieldFolder(const std::filesystem::path& folder);

// Makes the folder of a light field that is going to be written: what is put into subfolders before is kept.
// Throws Error as requireLightFieldFolder() does.
void beginLightFieldFolder(const std::filesystem::path& folder);

// A folder that is being written. Without commit() it is left without a manifest, and the next writer takes
// it over.
class LightFieldWriter {
public:
  // Takes over the folder and empties it. Throws Error as requireLightFieldFolder() does.
  LightFieldWriter(std::filesystem::path folder, std::string format, int version);

  // Path for one of the format's own files, which must be written before commit().
  std::filesystem::path file(std::string_view name);
  // Writes the capture's training views and the mesh, then the manifest with the checksums of all files.
  // Throws Error and Cancelled.
  void commit(const capture::Capture& capture, const TriangleMesh& mesh, const Numbers& numbers,
              const Progress& progress = {});

private:
  std::filesystem::path folder_;
  std::string format_;
  int version_;
  std::map<std::string, std::filesystem::path, std::less<>> files_;
};

// A finished folder.
class LightFieldFolder {
public:
  // Reads manifest, views and mesh. Views and mesh are checked against the checksums in the manifest; check()
  // does so for the format's own files. Throws Error naming file and field, also for another format or
  // version; and Cancelled.
  LightFieldFolder(std::filesystem::path folder, std::string_view format, int version,
                   const Progress& progress = {});

  const std::filesystem::path& path() const { return folder_; }
  const capture::Capture& rig() const { return rig_; }
  const TriangleMesh& mesh() const { return mesh_; } // its triangles have valid corners, positions are finite
  // Hash of the manifest, which through its checksums identifies all content.
  uint64_t identity() const { return identity_; }

  // A number of the manifest. Throws Error if it is missing or outside lowest..highest.
  double number(std::string_view name, double lowest, double highest) const;
  // A whole number of the manifest. Throws Error if it is missing, not whole or outside lowest..highest.
  size_t count(std::string_view name, size_t lowest, size_t highest) const;
  // Path of one of the format's own files. Throws Error if the manifest does not list it.
  std::filesystem::path file(std::string_view name) const;
  // Throws Error unless a file has the size and the checksum of the manifest; Cancelled.
  void check(std::string_view name, const Progress& progress = {}) const;
  // Bytes of all files.
  uint64_t bytes() const;

private:
  struct Entry {
    uint64_t bytes = 0;
    std::string checksum;
  };

  std::filesystem::path folder_;
  capture::Capture rig_;
  TriangleMesh mesh_;
  Numbers numbers_;
  std::map<std::string, Entry, std::less<>> entries_;
  uint64_t identity_ = 0;
};

} // namespace surflect::lightfield
