#include "render/lightfield/slf/field_file.h"

#include "render/lightfield/common/binary.h"
#include "render/lightfield/slf/charts.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

namespace surflect::slf {

namespace {

using lightfield::append, lightfield::Reader;

constexpr std::string_view kMagic = "slf field";
constexpr uint64_t kMostDirections = 1 << 14;

std::string numbered(const char* name, size_t index) { return name + ('[' + std::to_string(index) + ']'); }

void requireBelow(std::span<const uint32_t> indices, size_t end, const std::string& field) {
  for (size_t i = 0; i < indices.size(); ++i)
    if (indices[i] >= end)
      throw Error::mismatch("below " + std::to_string(end), std::to_string(indices[i]))
          .at('[' + std::to_string(i) + ']')
          .at(field);
}

DirectionMesh takeDirectionMesh(Reader& reader, const std::string& field) {
  const uint64_t count = reader.take(4, kMostDirections, field + ".directions");
  const std::vector<double> numbers = reader.takeMany<double>(3 * count, field + ".directions");
  std::vector<Direction> directions;
  for (size_t i = 0; i < count; ++i)
    directions.emplace_back(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  try {
    return DirectionMesh(std::move(directions));
  } catch (Error& error) {
    throw std::move(error).at(field);
  }
}

// Checks the triangles of a chart against those of the mesh, and counts them.
void requireTrianglesOf(const Chart& chart, const TriangleMesh& mesh, std::vector<uint8_t>& isCovered,
                        const std::string& field) {
  requireBelow(chart.meshTriangles, mesh.triangles.size(), field + ".meshTriangles");
  for (size_t t = 0; t < chart.triangles.size(); ++t) {
    requireBelow(chart.triangles[t], chart.vertices.size(), field + numbered(".triangles", t));
    const uint32_t whole = chart.meshTriangles[t];
    for (size_t corner = 0; corner < 3; ++corner)
      // Vertices at one position count as one.
      if (mesh.positions[chart.vertices[chart.triangles[t][corner]]] !=
          mesh.positions[mesh.triangles[whole][corner]])
        throw Error("differs from triangle " + std::to_string(whole) + " of the mesh")
            .at(field + numbered(".triangles", t));
    if (std::exchange(isCovered[whole], uint8_t{1}))
      throw Error("triangle " + std::to_string(whole) + " of the mesh occurs twice")
          .at(field + numbered(".meshTriangles", t));
  }
}

Region takeRegion(Reader& reader, const Field& field, std::vector<uint8_t>& isCovered,
                  const std::string& name) {
  Region region;
  Chart& chart = region.chart;
  region.directionMesh =
      static_cast<uint32_t>(reader.take(0, field.directionMeshes.size() - 1, name + ".directionMesh"));
  chart.width = static_cast<int>(reader.take(1, uint64_t{kLongestSide}, name + ".width"));
  chart.height = static_cast<int>(reader.take(1, uint64_t{kLongestSide}, name + ".height"));
  const uint64_t vertices = reader.take(3, field.mesh.positions.size(), name + ".vertices"),
                 triangles = reader.take(1, field.mesh.triangles.size(), name + ".triangles");
  chart.vertices = reader.takeMany<uint32_t>(vertices, name + ".vertices");
  requireBelow(chart.vertices, field.mesh.positions.size(), name + ".vertices");
  const std::vector<float> coordinates = reader.takeMany<float>(2 * vertices, name + ".coordinates");
  for (size_t i = 0; i < coordinates.size(); ++i)
    if (!(coordinates[i] >= 0 && coordinates[i] <= 1))
      throw Error::mismatch("0..1", numberText(static_cast<double>(coordinates[i])))
          .at(name + numbered(".coordinates", i / 2));
  for (size_t i = 0; i < vertices; ++i)
    chart.coordinates.emplace_back(coordinates[2 * i], coordinates[2 * i + 1]);
  chart.triangles = reader.takeMany<std::array<uint32_t, 3>>(triangles, name + ".triangles");
  chart.meshTriangles = reader.takeMany<uint32_t>(triangles, name + ".meshTriangles");
  requireTrianglesOf(chart, field.mesh, isCovered, name);
  return region;
}

std::vector<uint64_t> takePlaces(Reader& reader, const Field& field, const Region& region, uint64_t texels,
                                 const std::string& name) {
  const size_t directions = field.directionMeshes[region.directionMesh].directions().size();
  std::vector<uint64_t> places = reader.takeMany<uint64_t>(directions, name + ".textures");
  const uint64_t size = region.chart.texels();
  for (size_t i = 0; i < directions; ++i)
    if (places[i] != kNotStored && (size > texels || places[i] > texels - size))
      throw Error::mismatch("within the " + std::to_string(texels) + " texels of " + kTexturesFile,
                            std::to_string(size) + " texels at " + std::to_string(places[i]))
          .at(name + numbered(".textures", i));
  return places;
}

} // namespace

std::vector<std::byte> fieldBytes(const Field& field, const TexturePlaces& places) {
  std::vector<std::byte> bytes;
  append(bytes, std::span<const char>(kMagic));
  append(bytes, field.directionMeshes.size());
  for (const DirectionMesh& mesh : field.directionMeshes) {
    append(bytes, mesh.directions().size());
    for (const Direction& direction : mesh.directions())
      append(bytes, std::span<const double>(std::array{direction.x(), direction.y(), direction.z()}));
  }
  append(bytes, field.regions.size());
  for (size_t region = 0; region < field.regions.size(); ++region) {
    const Chart& chart = field.regions[region].chart;
    for (const uint64_t number : {uint64_t{field.regions[region].directionMesh},
                                  static_cast<uint64_t>(chart.width), static_cast<uint64_t>(chart.height),
                                  uint64_t{chart.vertices.size()}, uint64_t{chart.triangles.size()}})
      append(bytes, number);
    append(bytes, std::span<const uint32_t>(chart.vertices));
    for (const Vec2<float>& coordinates : chart.coordinates)
      append(bytes, std::span<const float>(std::array{coordinates[0], coordinates[1]}));
    append(bytes, std::span<const std::array<uint32_t, 3>>(chart.triangles));
    append(bytes, std::span<const uint32_t>(chart.meshTriangles));
    append(bytes, std::span<const uint64_t>(places[region]));
  }
  return bytes;
}

StoredField parseField(std::span<const std::byte> bytes, TriangleMesh mesh, uint64_t texels) {
  Reader reader(bytes);
  StoredField stored;
  Field& field = stored.field;
  field.mesh = std::move(mesh);
  reader.takeStart(kMagic);
  // Every direction mesh and every region takes more than 8 bytes.
  const uint64_t meshes = reader.take(1, bytes.size() / 8, "directionMeshes");
  for (size_t i = 0; i < meshes; ++i)
    field.directionMeshes.push_back(takeDirectionMesh(reader, numbered("directionMeshes", i)));
  const uint64_t regions = reader.take(1, bytes.size() / 8, "regions");
  std::vector<uint8_t> isCovered(field.mesh.triangles.size(), 0);
  for (size_t i = 0; i < regions; ++i) {
    const std::string name = numbered("regions", i);
    field.regions.push_back(takeRegion(reader, field, isCovered, name));
    stored.places.push_back(takePlaces(reader, field, field.regions.back(), texels, name));
  }
  reader.requireEnd();
  if (const auto missing = std::ranges::find(isCovered, 0); missing != isCovered.end())
    throw Error("triangle " + std::to_string(missing - isCovered.begin()) + " of the mesh is in none")
        .at("regions");
  return stored;
}

} // namespace surflect::slf
