// Lumigraphs on disk: a folder of light_field_folder.h, of format "surflect lumigraph", with the texels of
// all slabs in texels.bin and, in the manifest, the numbers from which the mesh gives the slabs again.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lumigraph/lumigraph.h"
#include "render/lightfield/lumigraph/slab.h"
#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>

namespace surflect::lumigraph {

inline constexpr const char* kFormat = "surflect lumigraph";
inline constexpr int kVersion = 1;

// How a lumigraph was made, in numbers.
struct Recipe {
  SlabOptions slabs = {};
  size_t triangles = 0; // of the geometry that corrects depth; 0: the object's own
};

// A lumigraph that is being written, node by node.
class LumigraphWriter {
public:
  // Takes over a folder as LightFieldWriter does. Throws Error.
  explicit LumigraphWriter(const std::filesystem::path& folder);

  // Appends the picture of the next node: i fastest, then j, then the slab. Throws Error.
  void append(std::span<const Texel> picture);
  // Finishes the folder. Throws Error and Cancelled.
  void commit(const capture::Capture& trainingViews, const TriangleMesh& mesh, const Recipe& recipe,
              const Progress& progress = {});

private:
  lightfield::LightFieldWriter folder_;
  std::filesystem::path path_;
  std::ofstream file_;
};

// Recipe of a folder. Throws Error for numbers out of range.
Recipe recipeOf(const lightfield::LightFieldFolder& folder);

// Reads all texels, 8 bytes each, and makes the geometry that corrects depth: `triangles` overrides the
// recipe's. Throws Error naming the file if its size or checksum is wrong, or if a texel is not finite; and
// Cancelled.
Lumigraph readLumigraph(const lightfield::LightFieldFolder& folder, std::optional<size_t> triangles = {},
                        const Progress& progress = {});

} // namespace surflect::lumigraph
