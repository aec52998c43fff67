// Builds a lumigraph from views under fixed light.  [Azuma 1999, §4.1]
#pragma once

#include "render/lightfield/common/ray_radiance.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/slab.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::lumigraph {

// Ghosting by wrong depth.
//
// [Azuma 1999, §4.3.2, Fig. 4.5]
// Symbols: d depth of the object below the st plane, e error of the depth that is used to correct rays, p
// distance of the planes, s spacing of st nodes, u spacing of uv texels.

// Distance, in texels, between what two neighbouring nodes show at one pixel: p e s / (d (d + e) u).
// Two rays from nodes s apart that meet at depth d + e are s e / (d + e) apart at depth d, which the planes'
// scale p / d takes to the uv plane.
inline double ghostOffset(double p, double e, double s, double d, double u) {
  assert(d > 0 && d + e > 0 && u > 0);
  return p * e * s / (d * (d + e) * u);
}

// Errors of a simplified geometry along lines of a lumigraph that meet both the object and the geometry.
struct DepthErrors {
  size_t lines = 0;
  double meanDepth = 0, worstDepth = 0;   // |e|, in scene units
  double meanOffset = 0, worstOffset = 0; // |ghostOffset()|, in texels
};

// Errors along lines through the centres of every `step`-th texel in rows and columns of all pictures.
DepthErrors depthErrors(const Slabs& slabs, const RayCaster<AcquisitionSpace>& object,
                        const TriangleMesh& geometry, int step, const Progress& progress = {});

// Lines of a lumigraph from photographs, by ray tracing.
//
// [Azuma 1999, §4.1]
using ResampleOptions = lightfield::RayBlend; // nearest: as [Azuma 1999, §4.1] does
using Sample = lightfield::RaySample;

// Lines of a node's picture by kind.
struct Tally {
  size_t seen = 0, unseen = 0, missed = 0;
};

class Resampler {
public:
  // Reads the training views of a capture, which must outlive this object. Throws Error and Cancelled.
  Resampler(const lightfield::Views& views, const ResampleOptions& options, const Progress& progress = {})
      : rays_(views, options, progress) {}

  // Radiance where a line first meets the object (ray_radiance.h).
  Sample at(const Line& line) const { return rays_.along(line.origin, line.direction); }

  // Picture of a node. A texel is the radiance of one line, that through its centre [Azuma 1999, §4.1]: the
  // mean over the texel's area would blur the photographs once more. Colours of lines that miss the object,
  // or that no view sees, are filled from those around them (pull_push.h). Throws Cancelled.
  std::vector<Texel> picture(const Slab& slab, int i, int j, Tally& tally,
                             const Progress& progress = {}) const;

private:
  lightfield::RayRadiance rays_;
};

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

// Writes the folder (lumigraph_file.h). Only training views are read. Throws Error, before any picture is
// made also where the pictures do not fit on the disk or into memory; and Cancelled.
BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::lumigraph
