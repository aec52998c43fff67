#include "render/lightfield/slf/field_file.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/slf/charts.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <span>
#include <string>
#include <utility>

namespace surflect::slf {

namespace {

constexpr uint64_t kMostDirections = 1 << 14;

std::string numbered(const char* name, size_t index) { return name + ('[' + std::to_string(index) + ']'); }

void describeDirections(Archive& archive, std::vector<DirectionMesh>& meshes, size_t mesh) {
  std::vector<Direction> directions;
  std::vector<std::array<uint32_t, 3>> triangles;
  if (!archive.isReading()) {
    directions.assign(meshes[mesh].directions().begin(), meshes[mesh].directions().end());
    triangles.assign(meshes[mesh].triangles().begin(), meshes[mesh].triangles().end());
  }
  size_t count = directions.size();
  archive.number<uint64_t>("directions", count, {4, kMostDirections});
  archive.array<double>("directions", directions, count);
  archive.array<uint32_t>("triangles", triangles, 2 * count - 4, Below(count)); // Euler's formula
  if (archive.isReading()) meshes.emplace_back(std::move(directions), std::move(triangles));
}

void describeChart(Archive& archive, Chart& chart, const TriangleMesh& mesh) {
  size_t vertices = chart.vertices.size(), triangles = chart.triangles.size();
  archive.number<uint64_t>("width", chart.width, {1, kLongestSide});
  archive.number<uint64_t>("height", chart.height, {1, kLongestSide});
  archive.number<uint64_t>("vertices", vertices, {3, mesh.positions.size()});
  archive.number<uint64_t>("triangles", triangles, {1, mesh.triangles.size()});
  archive.array<uint32_t>("vertices", chart.vertices, vertices, Below(mesh.positions.size()));
  archive.array<float>("coordinates", chart.coordinates, vertices, {0, 1});
  archive.array<uint32_t>("triangles", chart.triangles, triangles, Below(vertices));
  archive.array<uint32_t>("meshTriangles", chart.meshTriangles, triangles, Below(mesh.triangles.size()));
}

// field.bin. When it is read, the field has its mesh.
void describeField(Archive& archive, Field& field, TexturePlaces& places) {
  size_t meshes = field.directionMeshes.size(), regions = field.regions.size(), region = 0;
  archive.magic("slf field");
  archive.number<uint64_t>("directionMeshes", meshes, {1, archive.left()});
  for (size_t mesh = 0; mesh < meshes; ++mesh)
    atField(numbered("directionMeshes", mesh),
            [&] { describeDirections(archive, field.directionMeshes, mesh); });
  archive.number<uint64_t>("regions", regions, {1, field.mesh.triangles.size()});
  places.resize(regions);
  archive.each("regions", field.regions, regions, [&](Region& own) {
    archive.number<uint64_t>("directionMesh", own.directionMesh, Below(meshes));
    describeChart(archive, own.chart, field.mesh);
    archive.array<uint64_t>("textures", places[region++],
                            field.directionMeshes[own.directionMesh].directions().size());
  });
}

// Throws Error unless the triangles of a chart are those of the mesh, which it marks as covered.
void requireTrianglesOf(const Chart& chart, const TriangleMesh& mesh, std::vector<uint8_t>& isCovered) {
  for (size_t t = 0; t < chart.triangles.size(); ++t) {
    const uint32_t whole = chart.meshTriangles[t];
    for (size_t corner = 0; corner < 3; ++corner)
      // Vertices at one position count as one.
      if (mesh.positions[chart.vertices[chart.triangles[t][corner]]] !=
          mesh.positions[mesh.triangles[whole][corner]])
        throw Error("differs from triangle " + std::to_string(whole) + " of the mesh")
            .at(numbered("triangles", t));
    if (std::exchange(isCovered[whole], uint8_t{1}))
      throw Error("triangle " + std::to_string(whole) + " of the mesh occurs twice")
          .at(numbered("meshTriangles", t));
  }
}

// Throws Error unless textures of a size lie within textures.bin.
void requirePlaces(std::span<const uint64_t> places, uint64_t size, uint64_t texels) {
  for (size_t i = 0; i < places.size(); ++i)
    if (places[i] != kNotStored && (size > texels || places[i] > texels - size))
      throw Error::mismatch("within the " + std::to_string(texels) + " texels of " + kTexturesFile,
                            std::to_string(size) + " texels at " + std::to_string(places[i]))
          .at(numbered("textures", i));
}

} // namespace

std::vector<std::byte> fieldBytes(const Field& field, const TexturePlaces& places) {
  return written(field, [&](Archive& archive, Field& own) {
    TexturePlaces ownPlaces = places;
    describeField(archive, own, ownPlaces);
  });
}

StoredField parseField(std::span<const std::byte> bytes, TriangleMesh mesh, uint64_t texels) {
  StoredField stored;
  Field& field = stored.field;
  field.mesh = std::move(mesh);
  parse(bytes, [&](Archive& archive) { describeField(archive, field, stored.places); });
  std::vector<uint8_t> isCovered(field.mesh.triangles.size(), 0);
  for (size_t i = 0; i < field.regions.size(); ++i)
    atField(numbered("regions", i), [&] {
      requireTrianglesOf(field.regions[i].chart, field.mesh, isCovered);
      requirePlaces(stored.places[i], field.regions[i].chart.texels(), texels);
    });
  if (const auto missing = std::ranges::find(isCovered, 0); missing != isCovered.end())
    throw Error("triangle " + std::to_string(missing - isCovered.begin()) + " of the mesh is in none")
        .at("regions");
  return stored;
}

std::fstream& TextureWriter::at(uint64_t place) {
  if (!again_.is_open()) again_.open(file_.temporary(), std::ios::in | std::ios::out | std::ios::binary);
  const auto position = static_cast<std::streamoff>(place * sizeof(Texel));
  again_.seekg(position), again_.seekp(position);
  errno = 0;
  return again_;
}

Error TextureWriter::failed(const char* what) const {
  const int reason = errno;
  const std::string text = reason != 0 ? std::string(" (") + std::strerror(reason) + ')' : "";
  return Error(std::string("cannot ") + what + " textures again" + text).in(path_);
}

std::vector<Texel> TextureWriter::read(uint64_t place, size_t texels) {
  std::vector<Texel> result(texels);
  at(place).read(reinterpret_cast<char*>(result.data()),
                 static_cast<std::streamsize>(std::span(result).size_bytes()));
  if (!again_) throw failed("read");
  return result;
}

void TextureWriter::replace(uint64_t place, std::span<const Texel> texels) {
  at(place).write(reinterpret_cast<const char*>(texels.data()),
                  static_cast<std::streamsize>(texels.size_bytes()));
  if (!again_.flush()) throw failed("write");
}

TextureFile::TextureFile(OpenFile file, TexturePlaces places, std::span<const Region> regions)
    : file_(std::move(file)), places_(std::move(places)) {
  assert(places_.size() == regions.size());
  for (const Region& region : regions) sizes_.push_back(region.chart.texels());
}

std::vector<Texel> TextureFile::read(size_t region, size_t direction) const {
  std::vector<Texel> texels(sizes_[region]); // black
  const uint64_t place = places_[region][direction];
  if (place == kNotStored) return texels;
  try {
    lightfield::readTexels(file_, place, texels);
  } catch (Error& error) {
    throw std::move(error).at("texture " + std::to_string(direction) + " of region " +
                              std::to_string(region));
  }
  return texels;
}

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
