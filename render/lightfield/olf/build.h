// Builds an opacity light field from views with alpha.  [Vlasic 2003, §3, §4.2]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/packing.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace surflect::olf {

struct BuildOptions {
  Blending method = Blending::vdtm;
  Domain domain = Domain::sphere;
  std::optional<Visible> visible = {}; // none: all for an opacity hull, ring for another mesh
  Order order = Order::list;
  bool hull = false;    // an opacity hull, even if the capture has a mesh
  size_t triangles = 0; // of the mesh, at most; 0: as it is
  PackingOptions packing = {.budget = size_t{1} << 30};
};

struct BuildReport {
  bool isHull = false;
  size_t triangles = 0, vertices = 0, views = 0;
  size_t unseenVertices = 0;                             // that no view sees
  double visibleViews = 0;                               // of a vertex, on average
  int width = 0, height = 0;                             // of a packed view
  double scale = 1;                                      // of the packed views' sides
  bool s3tc = false;                                     // views are blocks
  double cutOffShare = 0;                                // of blocks: PackingReport::cutOffShare
  uint64_t pictureBytes = 0, packedBytes = 0, bytes = 0; // of whole pictures, packed views, the folder
  std::map<std::string, double> seconds;                 // by step
};

// Writes the folder (opacity_file.h). Only training views are read. A capture without a mesh has an opacity
// hull. The mesh of `views` may be replaced. Throws Error and Cancelled.
BuildReport build(lightfield::Views& views, const BuildOptions& options, const std::filesystem::path& folder,
                  const Progress& progress = {});

} // namespace surflect::olf
