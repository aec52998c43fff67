// Builds a lumigraph from views under fixed light.  [Azuma 1999, §4.1]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/depth_error.h"
#include "render/lightfield/lumigraph/resample.h"
#include "render/lightfield/lumigraph/slab.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace surflect::lumigraph {

struct BuildOptions {
  SlabOptions slabs = {};
  ResampleOptions resampling = {};
  size_t triangles = 0; // of the geometry that corrects depth; 0: the object's own
};

struct BuildReport {
  Slabs slabs;
  Tally texels;                          // by what their lines meet; their sum is the size of the lumigraph
  size_t blackPictures = 0;              // of nodes from which no photograph sees any part of the object
  size_t triangles = 0;                  // of the geometry that corrects depth
  std::optional<DepthErrors> errors;     // of that geometry, if it is simplified
  uint64_t bytes = 0;                    // of the folder
  std::map<std::string, double> seconds; // by step
};

// Writes the folder (lumigraph_file.h). Only training views are read. Throws Error and Cancelled.
BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::lumigraph
