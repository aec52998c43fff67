#include "render/lightfield/lfm/lfm_file.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

namespace surflect::lfm {

namespace {

void describeTable(Archive& archive, MapTable& table, size_t users, const MapShape& shape) {
  bool hasIndices = !isIdentity(table);
  archive.number<uint64_t>("count", table.maps.count, {0, archive.left()}); // a map takes more than a byte
  archive.number<uint64_t>("hasIndices", hasIndices, {0, 1});
  if (hasIndices && indexBytes(table) == 4) {
    archive.array<uint32_t>("mapOf", table.mapOf, users);
  } else if (hasIndices) {
    std::vector<uint16_t> narrow;
    for (const uint32_t map : table.mapOf) narrow.push_back(static_cast<uint16_t>(map)); // kNoMap: all bits 1
    archive.array<uint16_t>("mapOf", narrow, users);
    if (archive.isReading())
      for (const uint16_t map : narrow) table.mapOf.push_back(map == UINT16_MAX ? kNoMap : map);
  } else if (archive.isReading()) {
    if (table.maps.count != users)
      throw Error::mismatch(std::to_string(users), std::to_string(table.maps.count)).at("count");
    table.mapOf = upTo(users);
  }
  archive.array<uint8_t>("data", table.maps.data, bytesOf(shape, table.maps.coding, table.maps.count));
}

// Frame of unit axes x and z at right angles, as nearly as floats are. It keeps them, so that a frame that
// was read is written as it was.
VertexFrame frameOf(std::span<const float, 6> axes) {
  const Vec3<double> x(axes[0], axes[1], axes[2]), z(axes[3], axes[4], axes[5]);
  constexpr double kTolerance = 1e-5;
  const auto isSmall = [](double error) { return std::abs(error) < kTolerance; };
  if (!isSmall(x.norm() - 1) || !isSmall(z.norm() - 1) || !isSmall(x.dot(z)))
    throw Error("axes are not unit vectors at right angles");
  return {x, z.cross(x), z};
}

void describeFrame(Archive& archive, VertexFrame& frame) {
  std::array<float, 6> axes;
  for (size_t i = 0; i < 3; ++i) {
    axes[i] = static_cast<float>(frame.x[static_cast<Eigen::Index>(i)]);
    axes[3 + i] = static_cast<float>(frame.z[static_cast<Eigen::Index>(i)]);
  }
  archive.numbers<float>("axes", axes);
  if (archive.isReading()) frame = frameOf(axes);
}

// maps.bin. When it is read, the maps have their mesh and the number of their channels.
void describeMaps(Archive& archive, LightFieldMaps& maps) {
  const size_t vertices = maps.mesh.positions.size(), triangles = maps.mesh.triangles.size();
  size_t terms = maps.terms.size();
  Coding surface = terms > 0 ? maps.terms[0].surface.maps.coding : Coding::bytes,
         view = terms > 0 ? maps.terms[0].view.maps.coding : Coding::bytes;
  archive.magic(maps.channels == 4 ? "rgbamaps" : "lfm maps");
  archive.constant<uint64_t>("vertices", vertices);
  archive.constant<uint64_t>("triangles", triangles);
  archive.choice<uint64_t>("method", maps.method, Factorization::nmf);
  archive.choice<uint64_t>("layout", maps.layout, SurfaceLayout::scalar);
  archive.number<uint64_t>("samples", maps.samples, {2, PatchGrid::kMostPerEdge});
  archive.number<uint64_t>("viewSize", maps.viewSize, {kLeastViewSize, kLargestViewSize});
  archive.number<uint64_t>("higherViewSize", maps.higherViewSize, {kLeastViewSize, kLargestViewSize});
  archive.number<uint64_t>("terms", terms, {0, kMostTerms});
  archive.choice<uint64_t>("surfaceCoding", surface, Coding::dxt1);
  archive.choice<uint64_t>("viewCoding", view, Coding::dxt5);
  archive.choice<uint64_t>("meanCoding", maps.mean.maps.coding, Coding::dxt5);
  archive.number<float>("meanWhite", maps.meanWhite, {1e-30f});
  archive.each("frames", maps.frames, vertices, [&](VertexFrame& frame) { describeFrame(archive, frame); });
  size_t k = 0;
  archive.each("terms", maps.terms, terms, [&](Term& term) {
    const MapShape viewMaps = viewShape(maps, k++);
    if (archive.isReading()) term.surface.maps.coding = surface, term.view.maps.coding = view;
    archive.array<float>("scale", term.scale, vertices, {0});
    const size_t users = maps.layout == SurfaceLayout::packed ? triangles : 3 * triangles;
    atField("surface", [&] { describeTable(archive, term.surface, users, surfaceShape(maps)); });
    atField("view", [&] { describeTable(archive, term.view, vertices, viewMaps); });
  });
  atField("mean", [&] {
    describeTable(archive, maps.mean, maps.method == Factorization::pca ? triangles : 0, meanShape(maps));
  });
}

} // namespace

std::vector<std::byte> mapsBytes(const LightFieldMaps& maps) { return written(maps, describeMaps); }

LightFieldMaps parseMaps(std::span<const std::byte> bytes, TriangleMesh mesh, size_t channels) {
  LightFieldMaps maps;
  maps.channels = channels;
  maps.mesh = std::move(mesh);
  parse(bytes, [&](Archive& archive) { describeMaps(archive, maps); });
  requireComplete(maps);
  return maps;
}

LightFieldMaps readMaps(const lightfield::LightFieldFolder& folder, size_t channels,
                        const Progress& progress) {
  LightFieldMaps maps;
  folder.read(kMapsFile, progress,
              [&](std::span<const std::byte> bytes) { maps = parseMaps(bytes, folder.mesh(), channels); });
  return maps;
}

lightfield::Numbers numbersOf(const LightFieldMaps& maps) {
  return {{"terms", static_cast<double>(maps.terms.size())},
          {"samples", maps.samples},
          {"view_size", maps.viewSize},
          {"higher_view_size", maps.higherViewSize}};
}

void writeMaps(const LightFieldMaps& maps, const lightfield::LightFieldFolder& source,
               const std::filesystem::path& folder, const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kFormatTag, kFormatVersion);
  writer.write(kMapsFile, mapsBytes(maps));
  writer.commit(source, numbersOf(maps), progress);
}

void writeMaps(const LightFieldMaps& maps, const capture::Capture& capture,
               const std::filesystem::path& folder, const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kFormatTag, kFormatVersion);
  writer.write(kMapsFile, mapsBytes(maps));
  writer.commit(capture, maps.mesh, numbersOf(maps), progress);
}

OpenedMaps openMaps(const std::filesystem::path& path, const Progress& progress) {
  lightfield::LightFieldFolder folder(path, kFormatTag, kFormatVersion, progress);
  LightFieldMaps maps = readMaps(folder, 3, progress);
  return {std::move(folder), std::move(maps)};
}

} // namespace surflect::lfm
