#include "render/lightfield/common/mesh_file.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace surflect::lightfield {

namespace {

static_assert(sizeof(Point3<AcquisitionSpace>) == 12);

template <class T> std::string_view bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string textOf(const TriangleMesh& mesh) {
  const std::vector<uint64_t> counts = {mesh.positions.size(), mesh.triangles.size()};
  std::string text(bytesOf(counts));
  text += bytesOf(mesh.positions);
  text += bytesOf(mesh.triangles);
  return text;
}

TriangleMesh parsed(std::string_view text) {
  std::array<uint64_t, 2> counts{};
  if (text.size() < sizeof counts) throw Error("incomplete");
  std::memcpy(counts.data(), text.data(), sizeof counts);
  const auto [positions, triangles] = counts;
  const uint64_t numbers = text.size() / 12; // bounds both counts, so that the sum cannot overflow
  if (positions > numbers || triangles > numbers ||
      text.size() != sizeof counts + 12 * (positions + triangles))
    throw Error::mismatch(std::to_string(positions) + " positions and " + std::to_string(triangles) +
                              " triangles",
                          std::to_string(text.size()) + " bytes");
  TriangleMesh mesh;
  mesh.positions.resize(positions);
  mesh.triangles.resize(triangles);
  const char* start = text.data() + sizeof counts;
  if (positions > 0) std::memcpy(static_cast<void*>(mesh.positions.data()), start, 12 * positions);
  if (triangles > 0) std::memcpy(mesh.triangles.data(), start + 12 * positions, 12 * triangles);
  for (size_t i = 0; i < mesh.positions.size(); ++i)
    if (!mesh.positions[i].raw().allFinite())
      throw Error("is not finite").at("positions[" + std::to_string(i) + ']');
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t corner : mesh.triangles[t])
      if (corner >= positions)
        throw Error::mismatch("below " + std::to_string(positions), std::to_string(corner))
            .at("triangles[" + std::to_string(t) + ']');
  return mesh;
}

} // namespace

void writeMeshFile(const std::filesystem::path& path, const TriangleMesh& mesh) {
  writeFileAtomically(path, textOf(mesh));
}

TriangleMesh readMeshFile(const std::filesystem::path& path, const Progress& progress) {
  const std::string text = readFile(path, kLargestFile, progress);
  try {
    return parsed(text);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace surflect::lightfield
