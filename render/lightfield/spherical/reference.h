// A spherical light field rendered plainly: one ray a pixel, in double precision. The frame on the GPU is
// tested against it.  [Domingo 2007, §3]
#pragma once

#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

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

// The camera is a pinhole outside the object's sphere. Throws Error for other cameras, and Cancelled.
Picture renderReference(const DirectionTree& tree, const FieldShape& shape, const ShownImageOf& imageOf,
                        const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                        const Progress& progress = {});

} // namespace surflect::spherical
