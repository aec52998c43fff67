// A spherical light field rendered plainly: one ray a pixel, in double precision. The frame on the GPU is
// tested against it.  [Domingo 2007, §3]
#pragma once

#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"

#include <functional>

namespace surflect::spherical {

// Image that is shown for a pencil: its own or an ancestor's.
struct ShownImage {
  ImageNumber number = 0; // determines the direction of projection
  const PencilImage* image = nullptr;
};
using ShownImageOf = std::function<ShownImage(const Pencil&)>;

struct Picture {
  image::Image color; // RGBA, premultiplied
  image::Image depth; // distance along the viewing axis, infinite where alpha is 0
};

// `surface`: rays of the object's mesh. Throws Error for a camera that is not a pinhole or distorts, and
// Cancelled.
Picture renderReference(const DirectionTree& tree, const FieldShape& shape, const ShownImageOf& imageOf,
                        const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                        const RayCaster<AcquisitionSpace>& surface, const Progress& progress = {});

} // namespace surflect::spherical
