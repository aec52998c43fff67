#include "render/lightfield/spherical/tile_file.h"

#include "render/lightfield/common/binary.h"
#include "render/lightfield/common/read_at.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace surflect::spherical {

namespace {

constexpr std::string_view kMark = "SPHTILES";
constexpr uint64_t kFooterBytes = 4 * sizeof(uint64_t);

// Reads the index of a file of `fileBytes` bytes.
std::vector<TileEntry> readIndex(int descriptor, uint64_t fileBytes, size_t tiles, int size) {
  const uint64_t indexBytes = tiles * sizeof(TileEntry), endBytes = indexBytes + kFooterBytes;
  if (fileBytes < endBytes)
    throw Error::mismatch("at least " + std::to_string(endBytes) + " bytes", std::to_string(fileBytes))
        .at("size");
  std::vector<std::byte> footer(kFooterBytes), indexed(indexBytes);
  lightfield::readAt(descriptor, footer, fileBytes - kFooterBytes);
  lightfield::Reader reader(footer);
  try {
    reader.takeStart(kMark);
    reader.take(tiles, tiles, "tiles");
    reader.take(static_cast<uint64_t>(size), static_cast<uint64_t>(size), "size of a tile");
  } catch (Error& error) {
    throw std::move(error).at("footer");
  }
  lightfield::readAt(descriptor, indexed, fileBytes - endBytes);
  const uint64_t stated = reader.takeMany<uint64_t>(1, "checksum")[0];
  if (const uint64_t found = contentHash(indexed); found != stated)
    throw Error::mismatch(hex(stated), hex(found)).at("index: checksum");
  std::vector<TileEntry> index = lightfield::Reader(indexed).takeMany<TileEntry>(tiles, "index");
  const uint64_t end = fileBytes - endBytes;
  for (size_t tile = 0; tile < tiles; ++tile)
    if (const TileEntry& entry = index[tile]; entry.position > end || entry.bytes > end - entry.position)
      throw Error::mismatch("a place within " + std::to_string(end) + " bytes",
                            std::to_string(entry.bytes) + " bytes at " + std::to_string(entry.position))
          .at("index[" + std::to_string(tile) + "]");
  return index;
}

} // namespace

void TileWriter::append(std::span<const std::byte> encodedTile) {
  file_.write(encodedTile);
  index_.push_back({written_, encodedTile.size(), contentHash(encodedTile)});
  written_ += encodedTile.size();
}

void TileWriter::commit() {
  const auto index = std::as_bytes(std::span(index_));
  file_.write(index);
  file_.write(kMark);
  const std::array<uint64_t, 3> footer{index_.size(), static_cast<uint64_t>(size_), contentHash(index)};
  file_.write(std::as_bytes(std::span(footer)));
  file_.commit();
}

TileFile::TileFile(std::filesystem::path path, size_t tiles, int size)
    : path_(std::move(path)), descriptor_(openForReading(path_)), size_(size) {
  try {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) throw Error("cannot be read");
    index_ = readIndex(descriptor_, static_cast<uint64_t>(status.st_size), tiles, size);
  } catch (Error& error) {
    ::close(descriptor_);
    throw std::move(error).in(path_);
  }
}

TileFile::~TileFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

TileFile::TileFile(TileFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_),
      index_(std::move(other.index_)) {}

Tile TileFile::read(size_t tile) const {
  const TileEntry& entry = index_[tile];
  try {
    std::vector<std::byte> bytes(entry.bytes);
    lightfield::readAt(descriptor_, bytes, entry.position);
    if (const uint64_t found = contentHash(bytes); found != entry.checksum)
      throw Error::mismatch(hex(entry.checksum), hex(found)).at("checksum");
    return decoded(bytes, size_);
  } catch (Error& error) {
    throw std::move(error).at("tile[" + std::to_string(tile) + "]").in(path_);
  }
}

} // namespace surflect::spherical
