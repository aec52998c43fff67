// Files of a surface light field in its folder (render/lightfield/common/light_field_folder.h), specified in
// docs/format.md.
#pragma once

#include "render/lightfield/slf/field.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

inline constexpr const char* kFormatTag = "surflect surface light field";
inline constexpr int kFormatVersion = 1;
inline constexpr const char* kFieldFile = "field.bin";       // charts, directions, places of textures
inline constexpr const char* kTexturesFile = "textures.bin"; // texels, texture by texture

// Position of each texture in textures.bin, in texels, by region and direction.
using TexturePlaces = std::vector<std::vector<uint64_t>>;
// Place of a direction whose texture is not stored, because no picture can need it (resample.h).
inline constexpr uint64_t kNotStored = UINT64_MAX;

// Content of field.bin.
std::vector<std::byte> fieldBytes(const Field& field, const TexturePlaces& places);

struct StoredField {
  Field field;
  TexturePlaces places;
};
// Reads the content of field.bin for a mesh and a textures.bin with this many texels. Throws Error naming the
// field for bytes that are no such file, also unless each triangle of the mesh is in one region.
StoredField parseField(std::span<const std::byte> bytes, TriangleMesh mesh, uint64_t texels);

} // namespace surflect::slf
