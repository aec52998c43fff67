#include "render/lightfield/spherical/spherical_file.h"

#include "render/lightfield/common/light_field_folder.h"
#include "srf/image/deflate.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <bit>
#include <cassert>
#include <string>
#include <utility>

namespace surflect::spherical {

namespace {

constexpr size_t kPlanes = 5; // r, g, b, alpha, height; of 16 bits
constexpr size_t kEffort = 6; // of zlibStream()

uint16_t valueAt(const Tile& tile, size_t plane, size_t texel) {
  return plane < 4 ? tile.colors[texel][plane] : tile.heights[texel];
}

// Plane by plane: high bytes of the differences from the texel before in the row, then their low bytes.
std::vector<uint8_t> differences(const Tile& tile, size_t size) {
  const size_t texels = size * size;
  std::vector<uint8_t> bytes(2 * kPlanes * texels);
  for (size_t plane = 0; plane < kPlanes; ++plane)
    for (size_t texel = 0; texel < texels; ++texel) {
      const int before = texel % size == 0 ? 0 : valueAt(tile, plane, texel - 1);
      const auto difference = static_cast<uint16_t>(valueAt(tile, plane, texel) - before);
      bytes[2 * plane * texels + texel] = static_cast<uint8_t>(difference >> 8);
      bytes[(2 * plane + 1) * texels + texel] = static_cast<uint8_t>(difference);
    }
  return bytes;
}

Tile summed(std::span<const uint8_t> bytes, size_t size) {
  const size_t texels = size * size;
  Tile tile{std::vector<Texel>(texels), std::vector<Height>(texels)};
  for (size_t plane = 0; plane < kPlanes; ++plane)
    for (size_t texel = 0; texel < texels; ++texel) {
      const int before = texel % size == 0 ? 0 : valueAt(tile, plane, texel - 1);
      const int difference = bytes[2 * plane * texels + texel] << 8 | bytes[(2 * plane + 1) * texels + texel];
      const auto value = static_cast<uint16_t>(before + difference);
      (plane < 4 ? tile.colors[texel][plane] : tile.heights[texel]) = value;
    }
  return tile;
}

bool isValid(const Texel& texel) {
  constexpr uint16_t kOne = 0x3c00;
  return lightfield::isFinite(texel) && texel[3] <= kOne;
}

constexpr size_t kFooterBytes = 4 * sizeof(uint64_t);

// End of a file: the index of tiles of a size, and a footer.
void describeIndex(Archive& archive, std::vector<TileEntry>& index, size_t tiles, int size) {
  archive.array<uint64_t>("index", index, tiles);
  const uint64_t hash = archive.hash();
  archive.magic("SPHTILES");
  archive.constant<uint64_t>("tiles", tiles);
  archive.constant<uint64_t>("size of a tile", static_cast<uint64_t>(size));
  archive.checksum("checksum of the index", hash);
}

} // namespace

std::vector<std::byte> encoded(const Tile& tile, int size) {
  assert(tile.colors.size() == static_cast<size_t>(size) * static_cast<size_t>(size));
  assert(tile.heights.size() == tile.colors.size());
  const std::vector<uint8_t> raw = differences(tile, static_cast<size_t>(size));
  const std::string stream = image::zlibStream(std::as_bytes(std::span(raw)), kEffort);
  const auto bytes = std::as_bytes(std::span(stream));
  return {bytes.begin(), bytes.end()};
}

Tile decoded(std::span<const std::byte> bytes, int size) {
  const auto side = static_cast<size_t>(size);
  std::vector<uint8_t> raw(2 * kPlanes * side * side);
  if (!image::inflatesTo(bytes, std::as_writable_bytes(std::span(raw))))
    throw Error::mismatch("a zlib stream of " + std::to_string(raw.size()) + " bytes", "something else");
  Tile tile = summed(raw, side);
  for (size_t texel = 0; texel < tile.colors.size(); ++texel)
    if (!isValid(tile.colors[texel]))
      throw Error::mismatch("finite colours and an alpha of 0..1", "others")
          .at("texel " + std::to_string(texel));
  return tile;
}

void TileWriter::append(std::span<const std::byte> encodedTile) {
  file_.write(encodedTile);
  index_.push_back({written_, encodedTile.size(), contentHash(encodedTile)});
  written_ += encodedTile.size();
}

void TileWriter::commit() {
  file_.write(written(index_, [&](Archive& archive, std::vector<TileEntry>& index) {
    describeIndex(archive, index, index.size(), size_);
  }));
  file_.commit();
}

TileFile::TileFile(std::filesystem::path path, size_t tiles, int size) : file_(std::move(path)), size_(size) {
  inFile(file_.path(), [&] {
    const uint64_t endBytes = tiles * sizeof(TileEntry) + kFooterBytes;
    if (file_.bytes() < endBytes)
      throw Error::mismatch("at least " + std::to_string(endBytes) + " bytes", std::to_string(file_.bytes()))
          .at("size");
    const uint64_t end = file_.bytes() - endBytes;
    std::vector<std::byte> bytes(endBytes);
    file_.read(end, bytes);
    parse(bytes, [&](Archive& archive) { describeIndex(archive, index_, tiles, size); });
    for (size_t tile = 0; tile < tiles; ++tile)
      if (const TileEntry& entry = index_[tile]; entry.position > end || entry.bytes > end - entry.position)
        throw Error::mismatch("a place within " + std::to_string(end) + " bytes",
                              std::to_string(entry.bytes) + " bytes at " + std::to_string(entry.position))
            .at("index[" + std::to_string(tile) + "]");
  });
}

Tile TileFile::read(size_t tile) const try {
  const TileEntry& entry = index_[tile];
  std::vector<std::byte> bytes(entry.bytes);
  file_.read(entry.position, bytes);
  if (const uint64_t found = contentHash(bytes); found != entry.checksum)
    throw Error::mismatch(hex(entry.checksum), hex(found)).at("checksum");
  return decoded(bytes, size_);
} catch (Error& error) {
  throw std::move(error).at("tile[" + std::to_string(tile) + "]").in(file_.path());
}

namespace {

std::string fileOf(size_t level) { return "level" + std::to_string(level) + ".tiles"; }

size_t imagesOf(size_t level) { return imagesUpTo(level) - firstImageOf(level); }

void describeShape(lightfield::NumberArchive& archive, FieldShape& shape) {
  archive.number("levels", shape.levels, {1, kMostLevels});
  archive.number("size", shape.size, {kLeastSize, kLargestSize});
  for (int axis = 0; axis < 3; ++axis)
    archive.number(std::string("middle.") + "xyz"[axis], shape.sphere.middle[axis], {-1e15, 1e15});
  archive.number("radius", shape.sphere.radius, {1e-15, 1e15});
}

FieldShape readShape(const lightfield::LightFieldFolder& folder) {
  FieldShape shape;
  lightfield::NumberArchive numbers(folder);
  describeShape(numbers, shape);
  if (!std::has_single_bit(static_cast<unsigned>(shape.size)))
    throw Error::mismatch("a power of two", std::to_string(shape.size))
        .at("numbers.size")
        .in(folder.path() / "manifest.json");
  return shape;
}

} // namespace

SphericalWriter::SphericalWriter(const std::filesystem::path& folder, const FieldShape& shape)
    : folder_(folder, kFormat, kVersion), shape_(shape) {}

void SphericalWriter::append(std::span<const std::byte> encodedTile) {
  const auto level = pencilOf(static_cast<ImageNumber>(appended_)).level;
  if (appended_ == firstImageOf(level)) level_.emplace(folder_.file(fileOf(level)), shape_.size);
  level_->append(encodedTile);
  if (++appended_ == imagesUpTo(level)) level_->commit();
}

void SphericalWriter::commit(const capture::Capture& trainingViews, const TriangleMesh& mesh,
                             const Progress& progress) {
  assert(appended_ == shape_.images());
  folder_.commit(trainingViews, mesh, lightfield::numbersOf(shape_, describeShape), progress);
}

SphericalFile::SphericalFile(const lightfield::LightFieldFolder& folder) : shape_(readShape(folder)) {
  for (size_t level = 0; level < shape_.levels; ++level)
    levels_.emplace_back(folder.file(fileOf(level)), imagesOf(level), shape_.size);
}

PencilImage SphericalFile::read(ImageNumber image) const {
  const size_t level = pencilOf(image).level;
  Tile tile = levels_[level].read(image - firstImageOf(level));
  return mipmapped(shape_.size, std::move(tile.colors), std::move(tile.heights));
}

uint64_t SphericalFile::bytes(size_t level) const {
  uint64_t sum = 0;
  for (size_t tile = 0; tile < levels_[level].tiles(); ++tile) sum += levels_[level].bytes(tile);
  return sum;
}

} // namespace surflect::spherical
