#include "render/lightfield/lumigraph/lumigraph_file.h"

#include "render/lightfield/common/mesh_file.h"
#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/slab.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace surflect::lumigraph {

namespace {

constexpr const char* kTexelFile = "texels.bin";
constexpr const char* kGeometryFile = "geometry.bin";
constexpr const char* kFringeFile = "fringe.bin";
constexpr const char* kManifest = "manifest.json";
constexpr size_t kLongestSide = 16384; // texels; of textures of OpenGL
constexpr std::array<const char*, 2> kAxes{"u", "v"};

// Largest half that is finite.
constexpr uint16_t kLargestHalf = 0x7bff;

bool isFinite(const Texel& texel) {
  return std::ranges::all_of(texel, [](uint16_t half) { return (half & 0x7fff) <= kLargestHalf; });
}

std::string nameOf(size_t slab) { return "slab" + std::to_string(slab); }

void addNumbers(const Slab& slab, const std::string& name, lightfield::Numbers& numbers) {
  numbers[name + ".st_plane"] = slab.stPlane, numbers[name + ".uv_plane"] = slab.uvPlane;
  for (const size_t k : {size_t{0}, size_t{1}}) {
    numbers[name + ".st_low." + kAxes[k]] = slab.stLow[k];
    numbers[name + ".st_spacing." + kAxes[k]] = slab.stSpacing[k];
    numbers[name + ".uv_low." + kAxes[k]] = slab.uvLow[k];
  }
  numbers[name + ".uv_spacing"] = slab.uvSpacing;
  numbers[name + ".width"] = slab.width, numbers[name + ".height"] = slab.height;
}

Slab readSlab(const lightfield::LightFieldFolder& folder, size_t k) {
  constexpr double kFar = 1e15, kShort = 1e-15;
  const auto place = [&](const std::string& field) { return folder.number(nameOf(k) + field, -kFar, kFar); };
  const auto spacing = [&](const std::string& field) {
    return folder.number(nameOf(k) + field, kShort, kFar);
  };
  const auto size = [&](const std::string& field) {
    return static_cast<int>(folder.count(nameOf(k) + field, 2, kLongestSide));
  };
  Slab slab;
  slab.axis = static_cast<int>(k / 2), slab.sign = k % 2 == 0 ? 1 : -1;
  slab.stPlane = place(".st_plane"), slab.uvPlane = place(".uv_plane");
  for (const size_t i : {size_t{0}, size_t{1}}) {
    slab.stLow[i] = place(std::string(".st_low.") + kAxes[i]);
    slab.stSpacing[i] = spacing(std::string(".st_spacing.") + kAxes[i]);
    slab.uvLow[i] = place(std::string(".uv_low.") + kAxes[i]);
  }
  slab.uvSpacing = spacing(".uv_spacing");
  slab.nodes = static_cast<int>(folder.count("nodes", 2, kMostNodes));
  slab.width = size(".width"), slab.height = size(".height");
  return slab;
}

DepthGeometry readGeometry(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  DepthGeometry geometry{folder.mesh(), {}, folder.count("exact_outline", 0, 1) == 1};
  if (!geometry.exactOutline)
    for (const auto& [name, mesh] :
         {std::pair(kGeometryFile, &geometry.mesh), {kFringeFile, &geometry.fringe}}) {
      folder.check(name, progress);
      *mesh = lightfield::readMeshFile(folder.file(name), progress);
    }
  if (geometry.mesh.triangles.empty())
    throw Error("has no triangles").in(folder.path() / (geometry.exactOutline ? "mesh.bin" : kGeometryFile));
  return geometry;
}

// Lines from the nodes must meet the geometry beyond the st plane.
void requireInFront(const Slab& slab, const std::string& name, const DepthGeometry& geometry,
                    const std::filesystem::path& manifest) {
  double nearest = slab.uvPlane * slab.sign;
  for (const TriangleMesh* mesh : {&geometry.mesh, &geometry.fringe})
    for (const auto& p : mesh->positions)
      nearest = std::max(nearest, slab.sign * static_cast<double>(p.raw()[slab.axis]));
  if (!(slab.sign * slab.stPlane > nearest))
    throw Error::mismatch("a place in front of the geometry and the uv plane, at " +
                              numberText(slab.sign * nearest),
                          numberText(slab.stPlane))
        .at("numbers." + name + ".st_plane")
        .in(manifest);
}

} // namespace

LumigraphWriter::LumigraphWriter(const std::filesystem::path& folder)
    : folder_(folder, kFormat, kVersion), path_(folder_.file(kTexelFile)), file_(path_, std::ios::binary) {
  if (!file_) throw Error("cannot be created").in(path_);
}

void LumigraphWriter::append(std::span<const Texel> picture) {
  file_.write(reinterpret_cast<const char*>(picture.data()),
              static_cast<std::streamsize>(picture.size_bytes()));
  if (!file_) throw Error("cannot be written").in(path_);
}

void LumigraphWriter::commit(const capture::Capture& trainingViews, const TriangleMesh& mesh,
                             const Lumigraph& lumigraph, const Progress& progress) {
  file_.close();
  if (!file_) throw Error("cannot be written").in(path_);
  const DepthGeometry& geometry = lumigraph.geometry;
  if (!geometry.exactOutline) {
    lightfield::writeMeshFile(folder_.file(kGeometryFile), geometry.mesh);
    lightfield::writeMeshFile(folder_.file(kFringeFile), geometry.fringe);
  }
  lightfield::Numbers numbers{{"nodes", lumigraph.slabs[0].nodes},
                              {"overlap", lumigraph.overlap},
                              {"exact_outline", geometry.exactOutline ? 1 : 0}};
  for (size_t k = 0; k < kSlabs; ++k) addNumbers(lumigraph.slabs[k], nameOf(k), numbers);
  folder_.commit(trainingViews, mesh, numbers, progress);
}

Lumigraph readLumigraph(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  Lumigraph lumigraph;
  lumigraph.overlap = folder.number("overlap", 0, 1);
  lumigraph.geometry = readGeometry(folder, progress);
  for (size_t k = 0; k < kSlabs; ++k) {
    lumigraph.slabs[k] = readSlab(folder, k);
    requireInFront(lumigraph.slabs[k], nameOf(k), lumigraph.geometry, folder.path() / kManifest);
  }
  const std::filesystem::path path = folder.file(kTexelFile);
  folder.check(kTexelFile, progress);
  uint64_t expected = 0;
  for (const Slab& slab : lumigraph.slabs) expected += sizeof(Texel) * slab.texels();
  std::error_code failure;
  if (const uint64_t found = std::filesystem::file_size(path, failure); failure || found != expected)
    throw Error::mismatch(std::to_string(expected) + " bytes", std::to_string(found) + " bytes").in(path);
  std::ifstream file(path, std::ios::binary);
  for (size_t k = 0; k < kSlabs; ++k) {
    progress("read texels", static_cast<double>(k) / kSlabs);
    lumigraph.texels[k].resize(lumigraph.slabs[k].texels());
    file.read(reinterpret_cast<char*>(lumigraph.texels[k].data()),
              static_cast<std::streamsize>(sizeof(Texel) * lumigraph.texels[k].size()));
    if (!file) throw Error("cannot be read").in(path);
    if (const auto bad = std::ranges::find_if_not(lumigraph.texels[k], isFinite);
        bad != lumigraph.texels[k].end())
      throw Error("is not finite")
          .at("slab " + std::to_string(k) + ": texel " + std::to_string(bad - lumigraph.texels[k].begin()))
          .in(path);
  }
  return lumigraph;
}

} // namespace surflect::lumigraph
