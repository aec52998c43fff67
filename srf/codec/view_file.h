// View file: the blocks of one view's reflectance image, each located by an index and checked by its own
// checksum. Blocks without object texels are left out. docs/format.md specifies it to the byte.
//
// [Warren 2012] Hacker's Delight, 2nd ed.
#pragma once

#include "srf/codec/block.h"
#include "surfel/base/file.h"
#include "surfel/base/memory.h"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::codec {

inline constexpr int largestViewSide = 32768; // pixels
inline constexpr int mostLights = 65535;

struct ViewHeader {
  int width = 0, height = 0; // pixels
  int lights = 0;
  float white = 1;     // radiance of a white pixel
  float tolerance = 0; // error tolerance of every block; see blockErrorBound

  int blocksAcross() const { return (width + blockSize - 1) / blockSize; }
  int blocksDown() const { return (height + blockSize - 1) / blockSize; }
  // Number of block positions, present or not.
  size_t cells() const { return static_cast<size_t>(blocksAcross()) * static_cast<size_t>(blocksDown()); }
};

// Position of a block in the grid, counted in blocks.
struct BlockPosition {
  int x = 0, y = 0;
  friend bool operator==(const BlockPosition&, const BlockPosition&) = default;
};

struct PlacedRecord {
  BlockPosition position;
  std::vector<std::byte> record; // as encodeBlock makes it
};

// Entry of a block in the index of a view file.
struct ViewIndexEntry {
  uint32_t position = 0, size = 0, checksum = 0; // place in the grid; bytes of the record
};

// Bytes of a whole view file, for writeFileAtomically; `blocks` in row order.
std::vector<std::byte> viewFileBytes(const ViewHeader& header, std::span<const PlacedRecord> blocks);

// Writes a view file piece by piece. Records wait in a temporary file beside it, because the index stands
// before them; 12 bytes of each are in memory.
class ViewFileWriter {
public:
  // Throws Error where the temporary cannot be written, as do the methods.
  ViewFileWriter(std::filesystem::path path, const ViewHeader& header);
  // Appends blocks, in row order over all calls.
  void add(std::span<const PlacedRecord> blocks);
  // Replaces the file at the path.
  void commit();

private:
  std::filesystem::path path_;
  ViewHeader header_;
  AtomicFile records_; // never committed
  uint64_t bytes_ = 0; // of records
  std::vector<ViewIndexEntry> index_;
};

// An open view file. Stored blocks are numbered from 0 in row order. Safe to read from many threads at once.
class ViewFile {
public:
  // Opens a file and checks its header and index; blocks are checked when read. Throws Error with file and
  // field.
  explicit ViewFile(std::filesystem::path path);

  const std::filesystem::path& path() const { return file_.path(); }
  const ViewHeader& header() const { return header_; }
  // Checksum of header and index. As the index holds the blocks' checksums, it identifies the whole file.
  uint64_t checksum() const { return checksum_; }
  size_t blockCount() const { return positions_.size(); }
  size_t storedBytes(uint32_t block) const { return offsets_[block + 1] - offsets_[block]; }
  BlockPosition position(uint32_t block) const;
  // Index of a block's position in the grid, in row order.
  uint32_t cell(uint32_t block) const { return positions_[block]; }

  // The number of the block at a position inside the image; empty if the block was left out. Constant time.
  std::optional<uint32_t> find(BlockPosition position) const {
    assert(position.x >= 0 && position.x < header_.blocksAcross());
    assert(position.y >= 0 && position.y < header_.blocksDown());
    const auto place = static_cast<uint32_t>(position.y * header_.blocksAcross() + position.x);
    const auto& [bits, before] = stored_[place / 64];
    const uint64_t bit = uint64_t{1} << place % 64;
    if ((bits & bit) == 0) return std::nullopt;
    return before + bitCount(bits & (bit - 1));
  }

  // The number of leading entries of `blocks` that are best read in one piece, together with the gaps between
  // them. `blocks` must ascend and hold at least one.
  size_t readRunLength(std::span<const uint32_t> blocks) const;
  // Advises the system to read a stretch ahead.
  void adviseRead(std::span<const uint32_t> stretch) const;
  // Reads a stretch in one piece and calls use(i, block) for each of its blocks in turn. Throws Error with
  // the field "block (x, y)": the first block with a wrong checksum, or the first of the stretch if reading
  // fails.
  void read(std::span<const uint32_t> stretch, const std::function<void(size_t, Block)>& use) const;
  Block read(uint32_t block) const;

private:
  // Together in one cache line: find() reads both, in random order.
  struct Stored {
    uint64_t bits = 0;   // one for each position
    uint32_t before = 0; // number of bits set in all earlier entries
  };

  // Same as std::popcount, which compiles to a call unless the target's instruction set is known.  [Warren
  // 2012, §5-1]
  static uint32_t bitCount(uint64_t bits) {
    constexpr uint64_t kPairs = ~uint64_t{0} / 3, kFours = ~uint64_t{0} / 5, kBytes = ~uint64_t{0} / 17,
                       kOnes = ~uint64_t{0} / 255;
    bits -= bits >> 1 & kPairs;
    bits = (bits & kFours) + (bits >> 2 & kFours);
    bits = (bits + (bits >> 4)) & kBytes;
    return static_cast<uint32_t>(bits * kOnes >> 56);
  }

  UninitializedVector<std::byte> bytesAt(uint64_t offset, size_t count) const;
  Block decode(uint32_t block, std::span<const std::byte> record) const;
  std::string nameOf(uint32_t block) const;

  OpenFile file_;
  ViewHeader header_;
  uint64_t checksum_ = 0;
  // One entry for each stored block:
  std::vector<uint32_t> positions_; // y * blocksAcross + x, ascending
  std::vector<uint32_t> checksums_;
  std::vector<uint64_t> offsets_; // in the file; with one more for the end
  std::vector<Stored> stored_;    // one for each 64 positions
};

} // namespace surflect::codec
