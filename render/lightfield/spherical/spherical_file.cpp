#include "render/lightfield/spherical/spherical_file.h"

#include "surfel/base/error.h"

#include <bit>
#include <cassert>
#include <string>
#include <utility>

namespace surflect::spherical {

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
