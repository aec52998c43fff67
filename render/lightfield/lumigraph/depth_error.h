// Ghosting by wrong depth.
//
// [Azuma 1999, §4.3.2, Fig. 4.5]
// Symbols: d depth of the object below the st plane, e error of the depth that is used to correct rays, p
// distance of the planes, s spacing of st nodes, u spacing of uv texels.
#pragma once

#include "render/lightfield/lumigraph/slab.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <cassert>
#include <cstddef>

namespace surflect::lumigraph {

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

} // namespace surflect::lumigraph
