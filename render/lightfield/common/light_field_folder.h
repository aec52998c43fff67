// Folder of a light field on disk, of any format:
//
//   manifest.json     format, version, numbers and counts, checksums of the other files; written last
//   transforms.json   the training views that the light field was built from, in its coordinates
//   mesh.bin          the triangle mesh, exactly
//   others            the format's own; docs/format.md specifies them
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace surflect::lightfield {

// Numbers of a light field by name; counts are whole.
using Numbers = std::map<std::string, double>;

// Describes a mesh: counts, positions, corners of triangles.
void describeMesh(Archive& archive, TriangleMesh& mesh);

// Throws Error unless a light field may be written there: the folder is missing, empty, or holds one.
void requireLightFieldFolder(const std::filesystem::path& folder);

// Throws Error if the disk lacks room for a light field of so many bytes in a folder: "needs 64.0 GiB on disk
// for WHAT, but 12.0 GiB are free at FOLDER". Files of the folder, which a writer replaces, count as free.
void requireDisk(const std::filesystem::path& folder, double bytes, const std::string& what);

// Whether a folder holds a finished light field of a format.
bool isFinished(const std::filesystem::path& folder, std::string_view format);

// Makes the folder of a light field that is going to be written: what is put into subfolders before is kept.
// Throws Error as requireLightFieldFolder() does.
void beginLightFieldFolder(const std::filesystem::path& folder);

class LightFieldFolder;

// A folder that is being written. Without commit() it is left without a manifest, and the next writer takes
// it over.
class LightFieldWriter {
public:
  // Takes over the folder and empties it. Throws Error as requireLightFieldFolder() does.
  LightFieldWriter(std::filesystem::path folder, std::string format, int version);

  // Path for one of the format's own files, which must be written before commit().
  std::filesystem::path file(std::string_view name);
  // Writes one of the format's own files.
  void write(std::string_view name, std::span<const std::byte> content);
  // Writes the capture's training views and the mesh, then the manifest with the checksums of all files.
  // Throws Error and Cancelled.
  void commit(const capture::Capture& capture, const TriangleMesh& mesh, const Numbers& numbers,
              const Progress& progress = {});

  // Likewise with the views and the mesh of a finished folder, whose files are copied.
  void commit(const LightFieldFolder& source, const Numbers& numbers, const Progress& progress = {});

private:
  void finish(const Numbers& numbers, const Progress& progress);

  std::filesystem::path folder_;
  std::string format_;
  int version_;
  std::map<std::string, std::filesystem::path, std::less<>> files_;
};

// A finished folder.
class LightFieldFolder {
public:
  // Reads manifest, views and mesh. Views and mesh are checked against the checksums in the manifest;
  // checked() and read() do so for the format's own files. Throws Error naming file and field, also for
  // another format or version; and Cancelled.
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
  // Whether the manifest lists one of the format's own files.
  bool has(std::string_view name) const { return entries_.contains(name); }
  // Path of one of the format's own files. Throws Error if the manifest does not list it.
  std::filesystem::path file(std::string_view name) const;
  // Opens one of the files. Throws Error unless it has the size and the checksum of the manifest; Cancelled.
  OpenFile checked(std::string_view name, const Progress& progress = {}) const;
  // Calls use(bytes) for the content of a checked file, whose name its Errors get. Throws Error and
  // Cancelled.
  template <class Use> void read(std::string_view name, const Progress& progress, const Use& use) const {
    const std::string content = readFile(checked(name, progress).path(), kLargestFile, progress);
    inFile(file(name), [&] { use(std::as_bytes(std::span(content))); });
  }
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

// Mesh in a file. Throws Error naming file and field; Cancelled.
TriangleMesh storedMesh(const LightFieldFolder& folder, std::string_view name, const Progress& progress = {});

// Numbers of a manifest, each described once for writing and reading.
class NumberArchive {
public:
  NumberArchive() = default; // writes
  explicit NumberArchive(const LightFieldFolder& folder) : folder_(&folder) {}

  // A number within bounds; of an integer or enumeration a whole one. Throws Error as LightFieldFolder does.
  template <class Value> void number(const std::string& name, Value& value, Range<double> range) {
    if (!folder_)
      numbers_[name] = static_cast<double>(value);
    else if constexpr (std::is_floating_point_v<Value>)
      value = folder_->number(name, range.lowest, range.highest);
    else
      value = static_cast<Value>(
          folder_->count(name, static_cast<size_t>(range.lowest), static_cast<size_t>(range.highest)));
  }
  const Numbers& numbers() const { return numbers_; } // written

private:
  const LightFieldFolder* folder_ = nullptr;
  Numbers numbers_;
};

// Numbers of a value by describe(archive, value).
template <class Value, class Describe> Numbers numbersOf(const Value& value, const Describe& describe) {
  NumberArchive archive;
  describe(archive, const_cast<Value&>(value)); // which a writer does not change
  return archive.numbers();
}

// Texels in files of light fields: half floats r, g, b and a fourth channel, one texel after another. All are
// finite.
using Texel = std::array<uint16_t, 4>; // bits of half floats

inline bool isFinite(const Texel& texel) {
  constexpr uint16_t kExponent = 0x7c00;
  for (const uint16_t half : texel)
    if ((half & kExponent) == kExponent) return false;
  return true;
}

// Throws Error naming the file unless it holds this number of texels.
void requireTexels(const OpenFile& file, uint64_t texels);

// Reads the texels from a place on, counted in texels. Throws Error naming the file, also for a texel that is
// not finite; and Cancelled.
void readTexels(const OpenFile& file, uint64_t first, std::span<Texel> texels, const Progress& progress = {});

} // namespace surflect::lightfield
