#include "render/lightfield/spherical/spherical_file.h"
#include "surfel/base/file.h"
#include "tests/fuzz/fuzz.h"

#include <cstring>
#include <span>
#include <string>

namespace {

using surflect::spherical::TileEntry;

constexpr size_t kTiles = 2, kFooterBytes = 32;
constexpr int kSize = 8;

// Checksums are made right, or no damage would come past them.
std::string withTileChecksums(std::string file) {
  const size_t endBytes = kTiles * sizeof(TileEntry) + kFooterBytes;
  if (file.size() < endBytes) return file;
  const size_t index = file.size() - endBytes;
  const auto hashOf = [&](size_t begin, size_t count) {
    return surflect::contentHash(std::as_bytes(std::span(file)).subspan(begin, count));
  };
  for (size_t tile = 0; tile < kTiles; ++tile) {
    TileEntry entry;
    char* const place = &file[index + tile * sizeof entry];
    std::memcpy(&entry, place, sizeof entry);
    if (entry.position > index || entry.bytes > index - entry.position) continue;
    entry.checksum = hashOf(entry.position, entry.bytes);
    std::memcpy(place, &entry, sizeof entry);
  }
  const uint64_t checksum = hashOf(index, kTiles * sizeof(TileEntry));
  std::memcpy(&file[file.size() - sizeof checksum], &checksum, sizeof checksum);
  return file;
}

} // namespace

// A level of two images of 8 x 8 texels.
void surflect::fuzz_spherical(std::string_view input) {
  const spherical::TileFile file(memoryFile(withTileChecksums(std::string(input))), kTiles, kSize);
  for (size_t tile = 0; tile < kTiles; ++tile) {
    const spherical::Tile found = file.read(tile);
    if (found.colors.size() != size_t{kSize * kSize} || found.heights.size() != size_t{kSize * kSize})
      __builtin_trap();
  }
}
