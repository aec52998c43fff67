#include "render/lightfield/slf/open_field.h"

#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/texture_file.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::slf {

namespace {

StoredField readFieldFile(const std::filesystem::path& path, const TriangleMesh& mesh, uint64_t texels,
                          const Progress& progress) {
  try {
    const std::string content = readFile(path, kLargestFile, progress);
    return parseField(std::as_bytes(std::span(content)), mesh, texels);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

OpenedField openField(const std::filesystem::path& path, const Progress& progress) {
  lightfield::LightFieldFolder folder(path, kFormatTag, kFormatVersion, progress);
  folder.check(kFieldFile, progress);
  auto textures = std::make_unique<TextureFile>(folder.file(kTexturesFile));
  StoredField stored = readFieldFile(folder.file(kFieldFile), folder.mesh(), textures->texels(), progress);
  std::vector<size_t> sizes;
  for (const Region& region : stored.field.regions) sizes.push_back(region.chart.texels());
  textures->place(std::move(stored.places), std::move(sizes));
  return {std::move(folder), std::move(stored.field), std::move(textures)};
}

} // namespace surflect::slf
