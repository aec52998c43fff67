// Plan of a frame: the triangles and images that it draws, before any image is loaded.
#pragma once

#include "render/lightfield/spherical/look.h"
#include "render/lightfield/spherical/pencil_weights.h"
#include "render/lightfield/spherical/visible_pencils.h"

#include <cstddef>
#include <vector>

namespace surflect::spherical {

struct FramePlan {
  std::vector<WeightedTriangle> triangles; // in the order of drawing
  std::vector<ImageNumber> images; // of these triangles, each once, in the order of its first triangle
};

FramePlan planFrame(const DirectionTree& tree, const Window& window, const Look& look);

} // namespace surflect::spherical
