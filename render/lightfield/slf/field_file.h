// Files of a surface light field in its folder (render/lightfield/common/light_field_folder.h):
//
//   field.bin     direction meshes, charts of the regions, and where each texture is
//   textures.bin  texels, texture by texture
//
// All numbers are little-endian.
//
//   field.bin: "slf field"; 8 bytes for each number
//     count of direction meshes; of each: count of directions, then x, y, z (double) of each
//     count of regions; of each:
//       direction mesh, width, height, count of vertices, count of triangles
//       vertices (4 bytes each), coordinates (2 floats each), triangles (3 x 4 bytes each), triangles of the
//       mesh (4 bytes each)
//       for each direction the position of its texture in textures.bin, in texels; all bits 1: none
//   textures.bin: 4 half floats per texel
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
inline constexpr const char* kFieldFile = "field.bin";
inline constexpr const char* kTexturesFile = "textures.bin";

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
// field for bytes that are no such file: every index is checked, each triangle of the mesh is in one region,
// textures lie within the file, and coordinates are numbers in 0..1.
StoredField parseField(std::span<const std::byte> bytes, TriangleMesh mesh, uint64_t texels);

} // namespace surflect::slf
