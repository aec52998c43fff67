#include "render/lightfield/lumigraph/lumigraph_file.h"

#include "render/lightfield/lumigraph/depth_geometry.h"
#include "surfel/base/error.h"
#include "surfel/geometry/simplify.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace surflect::lumigraph {

namespace {

constexpr const char* kTexelFile = "texels.bin";
constexpr const char* kManifest = "manifest.json";

// Largest half that is finite.
constexpr uint16_t kLargestHalf = 0x7bff;

bool isFinite(const Texel& texel) {
  return std::ranges::all_of(texel, [](uint16_t half) { return (half & 0x7fff) <= kLargestHalf; });
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
                             const Recipe& recipe, const Progress& progress) {
  file_.close();
  if (!file_) throw Error("cannot be written").in(path_);
  folder_.commit(trainingViews, mesh,
                 {{"nodes", recipe.slabs.nodes},
                  {"texels", static_cast<double>(recipe.slabs.texels)},
                  {"distance", recipe.slabs.distance},
                  {"overlap", recipe.slabs.overlap},
                  {"triangles", static_cast<double>(recipe.triangles)}},
                 progress);
}

Recipe recipeOf(const lightfield::LightFieldFolder& folder) {
  Recipe recipe;
  recipe.slabs.nodes = static_cast<int>(folder.count("nodes", 2, 45));
  recipe.slabs.texels = folder.count("texels", 0, kMostTexels);
  recipe.slabs.distance = folder.number("distance", 1.25, 1000);
  recipe.slabs.overlap = folder.number("overlap", 0, 1);
  recipe.triangles = folder.count("triangles", 0, std::numeric_limits<uint32_t>::max());
  return recipe;
}

Lumigraph readLumigraph(const lightfield::LightFieldFolder& folder, std::optional<size_t> triangles,
                        const Progress& progress) {
  const Recipe recipe = recipeOf(folder);
  Lumigraph lumigraph;
  try {
    lumigraph.slabs = slabsAround(folder.mesh(), recipe.slabs);
  } catch (Error& error) {
    throw std::move(error).in(folder.path() / kManifest);
  }
  lumigraph.overlap = recipe.slabs.overlap;
  const size_t count = triangles.value_or(recipe.triangles);
  lumigraph.exactOutline = count == 0 || count >= folder.mesh().triangles.size();
  lumigraph.geometry = lumigraph.exactOutline ? folder.mesh() : simplified(folder.mesh(), count);
  if (!lumigraph.exactOutline) lumigraph.fringe = fringeAround(folder.mesh(), lumigraph.geometry);

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
