// Builds a spherical light field from views under fixed light, or from images made some other way.
// [Domingo 2007, §3.1]
#pragma once

#include "render/lightfield/common/ray_radiance.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/spherical/resample.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace surflect::spherical {

struct BuildOptions {
  size_t levels = 4; // 1..kMostLevels
  int size = 128;    // of an image's side, texels
};

struct BuildReport {
  FieldShape shape;
  size_t seen = 0, unseen = 0;           // texels on the object, by whether a photograph sees them
  std::vector<uint64_t> levelBytes;      // on disk, of the images that belong to each level
  uint64_t bytes = 0;                    // of the folder
  std::map<std::string, double> seconds; // by step
};

// Writes the folder (spherical_file.h). Only training views are read. Throws Error and Cancelled.
BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const lightfield::RayBlend& rays, const std::filesystem::path& folder,
                  const Progress& progress = {});

// Makes the image of `size` x `size` texels towards a unit direction. Called from several threads.
using MakeImage =
    std::function<ResampledImage(const Sphere& sphere, const Vec3<double>& direction, int size)>;

// Writes the folder with images that are made one by one. `cameras` and `mesh` are stored beside them.
BuildReport build(const capture::Capture& cameras, const TriangleMesh& mesh, const MakeImage& makeImage,
                  const BuildOptions& options, const std::filesystem::path& folder,
                  const Progress& progress = {});

} // namespace surflect::spherical
