#include "render/lightfield/lfm/lfm_file.h"

#include "render/lightfield/common/binary.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

namespace surflect::lfm {

namespace {

using lightfield::append, lightfield::Reader;

std::string_view startOf(size_t channels) { return channels == 4 ? "rgbamaps" : "lfm maps"; }

void appendTable(std::vector<std::byte>& bytes, const MapTable& table) {
  append(bytes, table.maps.count);
  const bool hasIndices = !isIdentity(table);
  append(bytes, uint64_t{hasIndices});
  if (hasIndices && indexBytes(table) == 4) append(bytes, std::span<const uint32_t>(table.mapOf));
  if (hasIndices && indexBytes(table) == 2) {
    std::vector<uint16_t> narrow;
    for (const uint32_t map : table.mapOf) narrow.push_back(static_cast<uint16_t>(map)); // kNoMap: all bits 1
    append(bytes, std::span<const uint16_t>(narrow));
  }
  append(bytes, std::span<const uint8_t>(table.maps.data));
}

MapTable takeTable(Reader& reader, size_t users, const MapShape& shape, Coding coding,
                   const std::string& field) {
  MapTable table;
  table.maps.coding = coding;
  table.maps.count = reader.take(0, reader.left(), field + ".count"); // a map takes more than a byte
  const bool hasIndices = reader.take(0, 1, field + ".hasIndices") == 1;
  if (hasIndices && indexBytes(table) == 4) {
    table.mapOf = reader.takeMany<uint32_t>(users, field + ".mapOf");
  } else if (hasIndices) {
    for (const uint16_t map : reader.takeMany<uint16_t>(users, field + ".mapOf"))
      table.mapOf.push_back(map == UINT16_MAX ? kNoMap : map);
  } else {
    if (table.maps.count != users)
      throw Error::mismatch(std::to_string(users), std::to_string(table.maps.count)).at(field + ".count");
    table.mapOf.resize(users);
    std::iota(table.mapOf.begin(), table.mapOf.end(), 0u);
  }
  table.maps.data = reader.takeMany<uint8_t>(bytesOf(shape, coding, table.maps.count), field + ".data");
  return table;
}

template <class Enumeration>
Enumeration takeChoice(Reader& reader, Enumeration last, const std::string& field) {
  return static_cast<Enumeration>(reader.take(0, static_cast<uint64_t>(last), field));
}

// Frame of unit axes x and z at right angles, as nearly as floats are.
VertexFrame frameOf(std::span<const float> numbers, const std::string& field) {
  const Vec3<double> x(numbers[0], numbers[1], numbers[2]), z(numbers[3], numbers[4], numbers[5]);
  constexpr double kTolerance = 1e-5;
  const auto isSmall = [](double error) { return std::abs(error) < kTolerance; }; // not NaN
  if (!isSmall(x.norm() - 1) || !isSmall(z.norm() - 1) || !isSmall(x.dot(z)))
    throw Error("axes are not unit vectors at right angles").at(field);
  const Vec3<double> exactZ = z.normalized(), exactX = (x - x.dot(exactZ) * exactZ).normalized();
  return {exactX, exactZ.cross(exactX), exactZ};
}

} // namespace

std::vector<std::byte> mapsBytes(const LightFieldMaps& maps) {
  std::vector<std::byte> bytes;
  append(bytes, std::span<const char>(startOf(maps.channels)));
  const bool hasTerms = !maps.terms.empty();
  const Coding surface = hasTerms ? maps.terms[0].surface.maps.coding : Coding::bytes,
               view = hasTerms ? maps.terms[0].view.maps.coding : Coding::bytes;
  for (const size_t number :
       {maps.mesh.positions.size(), maps.mesh.triangles.size(), static_cast<size_t>(maps.method),
        static_cast<size_t>(maps.layout), static_cast<size_t>(maps.samples),
        static_cast<size_t>(maps.viewSize), maps.terms.size(), static_cast<size_t>(surface),
        static_cast<size_t>(view), static_cast<size_t>(maps.mean.maps.coding)})
    append(bytes, uint64_t{number});
  append(bytes, std::span<const float>(&maps.meanWhite, 1));
  for (const VertexFrame& frame : maps.frames) {
    std::array<float, 6> numbers;
    for (size_t i = 0; i < 3; ++i) {
      numbers[i] = static_cast<float>(frame.x[static_cast<Eigen::Index>(i)]);
      numbers[3 + i] = static_cast<float>(frame.z[static_cast<Eigen::Index>(i)]);
    }
    append(bytes, std::span<const float>(numbers));
  }
  for (const Term& term : maps.terms) {
    append(bytes, std::span<const float>(term.scale));
    appendTable(bytes, term.surface);
    appendTable(bytes, term.view);
  }
  appendTable(bytes, maps.mean);
  return bytes;
}

LightFieldMaps parseMaps(std::span<const std::byte> bytes, TriangleMesh mesh, size_t channels) {
  Reader reader(bytes);
  reader.takeStart(startOf(channels));
  LightFieldMaps maps;
  maps.channels = channels;
  maps.mesh = std::move(mesh);
  const size_t vertices = maps.mesh.positions.size(), triangles = maps.mesh.triangles.size();
  reader.take(vertices, vertices, "vertices");
  reader.take(triangles, triangles, "triangles");
  maps.method = takeChoice(reader, Method::nmf, "method");
  maps.layout = takeChoice(reader, SurfaceLayout::scalar, "layout");
  maps.samples = static_cast<int>(reader.take(2, PatchGrid::kMostPerEdge, "samples"));
  maps.viewSize = static_cast<int>(reader.take(kLeastViewSize, kLargestViewSize, "viewSize"));
  const size_t terms = reader.take(0, kMostTerms, "terms");
  const auto surface = takeChoice(reader, Coding::dxt1, "surfaceCoding");
  const auto view = takeChoice(reader, Coding::dxt5, "viewCoding");
  const auto mean = takeChoice(reader, Coding::dxt5, "meanCoding");
  maps.meanWhite = reader.takeMany<float>(1, "meanWhite")[0];
  const std::vector<float> axes = reader.takeMany<float>(6 * vertices, "frames");
  for (size_t v = 0; v < vertices; ++v)
    maps.frames.push_back(frameOf(std::span(axes).subspan(6 * v, 6), "frames[" + std::to_string(v) + ']'));
  const size_t users = maps.layout == SurfaceLayout::packed ? triangles : 3 * triangles;
  for (size_t k = 0; k < terms; ++k) {
    const std::string field = "terms[" + std::to_string(k) + ']';
    Term& term = maps.terms.emplace_back();
    term.scale = reader.takeMany<float>(vertices, field + ".scale");
    term.surface = takeTable(reader, users, surfaceShape(maps), surface, field + ".surface");
    term.view = takeTable(reader, vertices, viewShape(maps), view, field + ".view");
  }
  maps.mean = takeTable(reader, maps.method == Method::pca ? triangles : 0, meanShape(maps), mean, "mean");
  reader.requireEnd();
  requireComplete(maps);
  return maps;
}

void writeMaps(const LightFieldMaps& maps, const capture::Capture& capture,
               const std::filesystem::path& folder, const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kFormatTag, kFormatVersion);
  writeFileAtomically(writer.file(kMapsFile), mapsBytes(maps));
  writer.commit(capture, maps.mesh,
                {{"terms", static_cast<double>(maps.terms.size())},
                 {"samples", maps.samples},
                 {"view_size", maps.viewSize}},
                progress);
}

OpenedMaps openMaps(const std::filesystem::path& path, const Progress& progress) {
  lightfield::LightFieldFolder folder(path, kFormatTag, kFormatVersion, progress);
  folder.check(kMapsFile, progress);
  const std::filesystem::path file = folder.file(kMapsFile);
  try {
    const std::string content = readFile(file, kLargestFile, progress);
    LightFieldMaps maps = parseMaps(std::as_bytes(std::span(content)), folder.mesh());
    return {std::move(folder), std::move(maps)};
  } catch (Error& error) {
    throw std::move(error).in(file);
  }
}

} // namespace surflect::lfm
