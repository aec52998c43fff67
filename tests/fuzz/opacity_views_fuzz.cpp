#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/olf/opacity_file.h"
#include "tests/fuzz/fuzz.h"

#include <span>

// The two binary files of an opacity light field: two views of 4 x 4 texels or a block, and a mesh of four
// vertices.
void surflect::fuzz_opacity_views(std::string_view input) {
  constexpr int kTexels = 4;
  const TwoFiles files = twoFilesOf(input);
  olf::OpacityField field;
  field.mesh.positions.resize(4);
  field.cameras.resize(2);
  field.packed.width = field.packed.height = kTexels;
  olf::parseViews(std::as_bytes(std::span(files.first)), field);
  try {
    olf::PackedViews compressed = field.packed;
    olf::readBlocks(OpenFile(memoryFile(files.second)), compressed);
    if (compressed.layerBlocks(1).size() != size_t{kTexels * kTexels}) __builtin_trap();
  } catch (const Error&) {
  }
  field.packed.texels.resize(size_t{2} * kTexels * kTexels);
  const OpenFile texels(memoryFile(files.second));
  lightfield::requireTexels(texels, field.packed.texels.size());
  lightfield::readTexels(texels, 0, field.packed.texels);
  for (uint32_t vertex = 0; vertex < field.mesh.positions.size(); ++vertex)
    for (const uint32_t view : field.visible.of(vertex))
      if (field.packed.layer(view).size() != size_t{kTexels * kTexels}) __builtin_trap();
}
