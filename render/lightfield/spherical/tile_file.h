// File of the images of one level: compressed tiles, then their index, then a footer.
//
//   tiles    one after another (tile_coding.h)
//   index    for each tile its position, its number of bytes and its checksum; 64 bits each
//   footer   the text "SPHTILES", number of tiles, size of a tile's side, checksum of the index; 64 bits each
#pragma once

#include "render/lightfield/spherical/tile_coding.h"
#include "surfel/base/file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace surflect::spherical {

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
  ~TileFile();
  TileFile(TileFile&& other) noexcept;
  TileFile& operator=(TileFile&&) = delete;

  size_t tiles() const { return index_.size(); }
  // Bytes of a tile in the file.
  uint64_t bytes(size_t tile) const { return index_[tile].bytes; }
  // Throws Error naming file and tile if it cannot be read, has another checksum or cannot be decoded.
  Tile read(size_t tile) const;

private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  int size_;
  std::vector<TileEntry> index_;
};

} // namespace surflect::spherical
