// PLY files, ASCII and binary of either byte order, as columns of numbers.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/textured_mesh.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect {

// One property of an element: one number per item, or a list per item in values[start[i]] to
// values[start[i+1]].
struct PlyProperty {
  std::string name;
  bool isList = false;
  std::vector<double> values;
  std::vector<size_t> start; // lists only: items + 1 entries
};

struct PlyElement {
  std::string name;
  size_t count = 0;
  std::vector<PlyProperty> properties;

  const PlyProperty* find(std::string_view property) const;
  // Values of a property; throws Error with element and property if it is missing or a list.
  std::span<const double> scalars(std::string_view property) const;
};

struct PlyFile {
  std::vector<PlyElement> elements;

  const PlyElement* find(std::string_view element) const;
};

// Reads a file. Throws Error with the file and the faulty element, item or header line; and Cancelled.
PlyFile readPly(const std::filesystem::path& path, const Progress& progress = {});

// Parses the content of a file. Throws Error with the faulty element, item or header line; and Cancelled.
PlyFile parsePly(std::string_view content, const Progress& progress = {});

// A column of float32 values to write.
struct PlyColumn {
  std::string name;
  std::vector<float> values;
};

// Writes one element of float32 columns, binary little-endian, atomically.
void writePly(const std::filesystem::path& path, std::string_view element, std::span<const PlyColumn> columns,
              std::string_view comment);

// Named columns of a file as writePly makes it, fast: numbers are copied, not converted. Empty if the file
// has another form or lacks a column; parsePly then reads it or tells the fault. Throws Error for a faulty
// header, and Cancelled.
std::optional<std::vector<std::vector<float>>> parseWrittenPly(std::string_view content,
                                                               std::string_view element,
                                                               std::span<const std::string_view> columns,
                                                               const Progress& progress = {});

// Meshes in PLY files: faces and triangle strips, and their texture coordinates and normals.

// Reads all vertices and triangles. Throws Error with file and element, and Cancelled.
TriangleMesh readPlyMesh(const std::filesystem::path& path, const MeshReading& reading = {},
                         const Progress& progress = {});

// Reads the mesh with texture coordinates and normals (texturedMeshOf); `corner` is the file's vertex.
// Texture coordinates of vertices are s and t, u and v, or texture_u and texture_v; normals are nx, ny and
// nz. A face's list `texcoord`, two numbers per corner, overrides them.
TexturedMesh readTexturedPly(const std::filesystem::path& path, const Progress& progress = {});

} // namespace surflect
