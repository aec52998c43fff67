#include "render/lightfield/lumigraph/lumigraph_file.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/slab.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"

#include <algorithm>
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
constexpr double kLongestSide = 16384; // texels; of textures of OpenGL

std::string nameOf(size_t slab) { return "slab" + std::to_string(slab); }

void describeSlab(lightfield::NumberArchive& archive, Slab& slab, const std::string& name) {
  constexpr Range<double> kPlace{-1e15, 1e15}, kSpacing{1e-15, 1e15}, kSide{2, kLongestSide};
  archive.number(name + ".st_plane", slab.stPlane, kPlace);
  archive.number(name + ".uv_plane", slab.uvPlane, kPlace);
  for (const size_t k : {size_t{0}, size_t{1}}) {
    const std::string axis = k == 0 ? ".u" : ".v";
    archive.number(name + ".st_low" + axis, slab.stLow[k], kPlace);
    archive.number(name + ".st_spacing" + axis, slab.stSpacing[k], kSpacing);
    archive.number(name + ".uv_low" + axis, slab.uvLow[k], kPlace);
  }
  archive.number(name + ".uv_spacing", slab.uvSpacing, kSpacing);
  archive.number(name + ".width", slab.width, kSide);
  archive.number(name + ".height", slab.height, kSide);
}

void describeLumigraph(lightfield::NumberArchive& archive, Lumigraph& lumigraph) {
  archive.number("overlap", lumigraph.overlap, {0, 1});
  archive.number("exact_outline", lumigraph.geometry.exactOutline, {0, 1});
  for (size_t k = 0; k < kSlabs; ++k) {
    Slab& slab = lumigraph.slabs[k];
    archive.number("nodes", slab.nodes, {2, kMostNodes}); // of all slabs
    describeSlab(archive, slab, nameOf(k));
  }
}

void readGeometry(const lightfield::LightFieldFolder& folder, DepthGeometry& geometry,
                  const Progress& progress) {
  if (geometry.exactOutline)
    geometry.mesh = folder.mesh();
  else
    for (const auto& [name, mesh] :
         {std::pair(kGeometryFile, &geometry.mesh), {kFringeFile, &geometry.fringe}})
      *mesh = lightfield::storedMesh(folder, name, progress);
  if (geometry.mesh.triangles.empty())
    throw Error("has no triangles").in(folder.path() / (geometry.exactOutline ? "mesh.bin" : kGeometryFile));
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
    : folder_(folder, kFormat, kVersion), texels_(folder_.file(kTexelFile)) {}

void LumigraphWriter::append(std::span<const Texel> picture) { texels_.write(std::as_bytes(picture)); }

void LumigraphWriter::commit(const capture::Capture& trainingViews, const TriangleMesh& mesh,
                             const Lumigraph& lumigraph, const Progress& progress) {
  texels_.commit();
  const DepthGeometry& geometry = lumigraph.geometry;
  if (!geometry.exactOutline) {
    folder_.write(kGeometryFile, written(geometry.mesh, lightfield::describeMesh));
    folder_.write(kFringeFile, written(geometry.fringe, lightfield::describeMesh));
  }
  folder_.commit(trainingViews, mesh, lightfield::numbersOf(lumigraph, describeLumigraph), progress);
}

Lumigraph readLumigraph(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  Lumigraph lumigraph;
  lightfield::NumberArchive numbers(folder);
  describeLumigraph(numbers, lumigraph);
  readGeometry(folder, lumigraph.geometry, progress);
  uint64_t texels = 0;
  for (size_t k = 0; k < kSlabs; ++k) {
    Slab& slab = lumigraph.slabs[k];
    slab.axis = static_cast<int>(k / 2), slab.sign = k % 2 == 0 ? 1 : -1;
    requireInFront(slab, nameOf(k), lumigraph.geometry, folder.path() / kManifest);
    texels += slab.texels();
  }
  const OpenFile file = folder.checked(kTexelFile, progress);
  lightfield::requireTexels(file, texels);
  texels = 0;
  for (size_t k = 0; k < kSlabs; ++k) {
    progress("read texels", static_cast<double>(k) / kSlabs);
    lumigraph.texels[k].resize(lumigraph.slabs[k].texels());
    lightfield::readTexels(file, texels, lumigraph.texels[k], progress);
    texels += lumigraph.texels[k].size();
  }
  return lumigraph;
}

} // namespace surflect::lumigraph
