// Builds the folder of a surface light field from views.
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/texel_radiance.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace surflect::slf {

struct BuildOptions {
  size_t regions = 200;
  // Texels of the surface to aim at. 0: texels are as wide as a photograph's pixels on the surface, but not
  // more than kMostTexels.
  size_t texels = 0;
  // Sample directions: a subdivided octahedron's (octahedronDirections): 6, 18, 66, 258 or 1026; none:
  // directionsFor() the photographs.
  std::optional<size_t> directions = {};
  // Above 0: each region keeps its own subset of the sample directions, so that the textures left out are
  // reproduced within this error, relative to the white level of the photographs (resample.h).
  double tolerance = 0.002;
  Blend blend = Blend::ulr;
};
inline constexpr size_t kMostTexels = 500'000;

// Sample directions for so many photographs: of 18, 66 and 258, the number with the least ratio to theirs.
// Fewer directions blend photographs that differ; more repeat them.
size_t directionsFor(size_t photographs);

struct BuildReport {
  size_t regions = 0;
  size_t photographs = 0;
  size_t directions = 0;      // of a region, at most
  double texelSize = 0;       // in scene units
  double pixelFootprint = 0;  // width of a photograph's pixel on the surface, in scene units
  size_t directionMeshes = 0; // different ones
  size_t textures = 0;        // sum of directions over regions
  size_t texturesStored = 0;  // without those that no picture can need
  size_t surfaceTexels = 0;   // sum of texels of one texture of each region
  size_t texels = 0;          // of all stored textures
  size_t unseenTexels = 0;    // of the surface, that no photograph sees: filled from those around them
  size_t unseenRegions = 0;   // that no photograph sees: filled from their neighbours
  size_t blackRegions = 0;    // of the unseen regions, those not connected to a seen one: black
  double inventedShare = 0;   // not observed, of the stored texels in directions in front of them
  uint64_t bytes = 0;         // of the folder
  double regionSeconds = 0, photographSeconds = 0, visibilitySeconds = 0, textureSeconds = 0, fillSeconds = 0,
         fileSeconds = 0; // fill: of unseen texels
};

// Throws Error for options outside their ranges, and as Views::read(), regionsOf(), chartsOf() and
// LightFieldWriter do; and Cancelled. Held-out views are not read. Memory: photographs at 12 bytes
// per pixel of the object's rectangle; textures of about 40,000 texels, and 32 bytes for each photograph that
// sees one of them. Results do not depend on the number of threads.
BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const std::filesystem::path& folder, const Progress& progress = {});

// Builds with charts that are given: each triangle of the mesh is in one of them.
BuildReport buildWithCharts(const lightfield::Views& views, std::vector<Chart> charts,
                            const BuildOptions& options, const std::filesystem::path& folder,
                            const Progress& progress = {});

} // namespace surflect::slf
