// Images of pencils from photographs, by rays along the pencil's direction.  [Domingo 2007, §3.1]
#pragma once

#include "render/lightfield/common/ray_radiance.h"
#include "render/lightfield/spherical/pencil_image.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::spherical {

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

} // namespace surflect::spherical
