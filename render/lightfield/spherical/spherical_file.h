// Spherical light fields on disk: a folder of light_field_folder.h, of format "surflect spherical".
//
//   manifest.json   also levels, size of an image, and the object's sphere
//   level0.tiles .. images of each level in the order of their numbers
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/pencil_image.h"
#include "srf/capture/capture.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::spherical {

// File of the images of one level: compressed tiles, their index, and the number and size of tiles. Specified
// in docs/format.md.
struct Tile {
  std::vector<Texel> colors;
  std::vector<Height> heights;

  friend bool operator==(const Tile&, const Tile&) = default;
};

// Compresses a tile of size x size texels: differences of neighbouring texels, byte by byte, in a zlib
// stream.
std::vector<std::byte> encoded(const Tile& tile, int size);
// Inverse of encoded(). Throws Error unless the bytes are a tile of this size whose texels are as Texel says.
Tile decoded(std::span<const std::byte> bytes, int size);

struct TileEntry {
  uint64_t position = 0, bytes = 0, checksum = 0;
};

// Writes encoded tiles as they are made. The file appears at commit().
class TileWriter {
public:
  TileWriter(const std::filesystem::path& path, int size) : file_(path), size_(size) {}

  void append(std::span<const std::byte> encodedTile);
  void commit();

private:
  AtomicFile file_;
  int size_;
  uint64_t written_ = 0;
  std::vector<TileEntry> index_;
};

// Reads tiles by their numbers, from any thread.
class TileFile {
public:
  // Reads the index. Throws Error naming the file unless it has this many tiles of this size, each within the
  // file.
  TileFile(std::filesystem::path path, size_t tiles, int size);

  size_t tiles() const { return index_.size(); }
  // Bytes of a tile in the file.
  uint64_t bytes(size_t tile) const { return index_[tile].bytes; }
  // Throws Error naming file and tile if it cannot be read, has another checksum or cannot be decoded.
  Tile read(size_t tile) const;

private:
  OpenFile file_;
  int size_;
  std::vector<TileEntry> index_;
};

inline constexpr const char* kFormat = "surflect spherical";
inline constexpr int kVersion = 1;

struct FieldShape {
  size_t levels = 1; // 1..kMostLevels
  int size = 128;    // of an image's side, texels: a power of two, kLeastSize..kLargestSize
  Sphere sphere;

  size_t images() const { return imagesUpTo(levels - 1); }
};

// Images by number, wherever they are kept. read() may be called from several threads.
class ImageSource {
public:
  virtual ~ImageSource() = default;
  // Throws Error where an image cannot be read.
  virtual PencilImage read(ImageNumber image) const = 0;
};

// A field that is being written, image by image.
class SphericalWriter {
public:
  // Takes over a folder as LightFieldWriter does. Throws Error.
  SphericalWriter(const std::filesystem::path& folder, const FieldShape& shape);

  // Appends the next image. Throws Error.
  void append(std::span<const std::byte> encodedTile);
  // Finishes the folder once all images have been appended. Throws Error and Cancelled.
  void commit(const capture::Capture& trainingViews, const TriangleMesh& mesh, const Progress& progress = {});

private:
  lightfield::LightFieldWriter folder_;
  FieldShape shape_;
  size_t appended_ = 0;
  std::optional<TileWriter> level_; // that is being written
};

// A field's images on disk.
class SphericalFile : public ImageSource {
public:
  // Reads the indices of all levels; images are checked when they are read. Throws Error naming file and
  // field if a number is out of range, or a level is missing, truncated or damaged.
  explicit SphericalFile(const lightfield::LightFieldFolder& folder);

  const FieldShape& shape() const { return shape_; }
  PencilImage read(ImageNumber image) const override;
  // Bytes on disk of the images that belong to a level.
  uint64_t bytes(size_t level) const;

private:
  FieldShape shape_;
  std::vector<TileFile> levels_;
};

} // namespace surflect::spherical
