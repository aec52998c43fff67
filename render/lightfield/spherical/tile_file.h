// File of the images of one level: compressed tiles, their index, and the number and size of tiles. Specified
// in docs/format.md.
#pragma once

#include "render/lightfield/spherical/pencil_image.h"
#include "surfel/base/file.h"
#include "surfel/base/open_file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace surflect::spherical {

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

} // namespace surflect::spherical
