#include "render/lightfield/slf/open_field.h"

#include "render/lightfield/common/texel_file.h"
#include "render/lightfield/slf/field_file.h"

#include <span>
#include <utility>

namespace surflect::slf {

OpenedField openField(const std::filesystem::path& path, const Progress& progress) {
  lightfield::LightFieldFolder folder(path, kFormatTag, kFormatVersion, progress);
  OpenFile textures = folder.checked(kTexturesFile, progress);
  const uint64_t texels = textures.bytes() / sizeof(Texel);
  lightfield::requireTexels(textures, texels);
  StoredField stored;
  folder.read(kFieldFile, progress,
              [&](std::span<const std::byte> bytes) { stored = parseField(bytes, folder.mesh(), texels); });
  auto ofRegions =
      std::make_unique<TextureFile>(std::move(textures), std::move(stored.places), stored.field.regions);
  return {std::move(folder), std::move(stored.field), std::move(ofRegions)};
}

} // namespace surflect::slf
