// Builds a spherical light field from views under fixed light, or from images made some other way.
// [Domingo 2007, §3.1]
#pragma once

#include "render/lightfield/common/ray_radiance.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/spherical/pencil_image.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace surflect::spherical {

// Images of pencils from photographs, by rays along the pencil's direction.  [Domingo 2007, §3.1]

// Sphere around a mesh, slightly enlarged so that the texels at the border of an image are empty. Throws
// Error for a mesh without extent.
Sphere sphereAround(const TriangleMesh& mesh, int size);

// Heights on the object, continued smoothly to the texels beside it (pull_push.h).
std::vector<Height> continuedHeights(std::span<const float> heights, const std::vector<bool>& isOnObject,
                                     int size);

struct ResampledImage {
  std::vector<Texel> colors;
  std::vector<Height> heights;
  size_t seen = 0, unseen = 0; // texels whose ray meets the object, by whether a photograph sees it there
};

// Image towards a direction. A texel is the radiance of the ray through its centre. Colours that no
// photograph sees are filled from those around them (pull_push.h). Throws Cancelled.
ResampledImage resampled(const lightfield::RayRadiance& rays, const Sphere& sphere,
                         const Vec3<double>& direction, int size, const Progress& progress = {});

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

// Writes the folder with images that are made one by one. `cameras` and `mesh` are stored beside them. Throws
// Error also where the images will not fit on the disk by the mean size of the first 32, which those of level
// 0, in directions all around, belong to.
BuildReport build(const capture::Capture& cameras, const TriangleMesh& mesh, const MakeImage& makeImage,
                  const BuildOptions& options, const std::filesystem::path& folder,
                  const Progress& progress = {});

} // namespace surflect::spherical
