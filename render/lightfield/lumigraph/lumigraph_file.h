// Lumigraphs on disk: a folder of light_field_folder.h, of format "surflect lumigraph", specified in
// docs/format.md.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lumigraph/slab.h"
#include "srf/capture/capture.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <filesystem>
#include <span>

namespace surflect::lumigraph {

inline constexpr const char* kFormat = "surflect lumigraph";
inline constexpr int kVersion = 2;

// A lumigraph that is being written, node by node.
class LumigraphWriter {
public:
  // Takes over a folder as LightFieldWriter does. Throws Error.
  explicit LumigraphWriter(const std::filesystem::path& folder);

  // Appends the picture of the next node: i fastest, then j, then the slab. Throws Error.
  void append(std::span<const Texel> picture);
  // Finishes the folder: the object's mesh, and slabs, overlap and geometry of a lumigraph. Texels are those
  // that were appended, not the lumigraph's. Throws Error and Cancelled.
  void commit(const capture::Capture& trainingViews, const TriangleMesh& mesh, const Lumigraph& lumigraph,
              const Progress& progress = {});

private:
  lightfield::LightFieldWriter folder_;
  AtomicFile texels_;
};

// Reads a lumigraph; its texels take 8 bytes each. Throws Error naming the file and field if a number is out
// of range, an st plane does not stand in front of the geometry, or a texel is not finite; and Cancelled.
Lumigraph readLumigraph(const lightfield::LightFieldFolder& folder, const Progress& progress = {});

} // namespace surflect::lumigraph
