// The shot that is timed: the twisted doll under point lights.
#pragma once

#include "render/surfels/frame.h"
#include "srf/model/model.h"

#include <span>
#include <vector>

namespace surflect::bench {

struct Shot {
  warp::WarpPointer warp;
  capture::Camera<ObjectSpace> camera;
  std::vector<scene::ShotLight> lights;
  surfels::FrameOptions options;
};

// Camera that sees all of a cloud from the front (-y) and slightly above.
capture::Camera<ObjectSpace> frontCamera(const SurfelCloud& cloud, int width, int height);

// Shot of the cloud, seen by frontCamera, under point lights on all sides. The cloud is twisted around z, by
// 40 degrees over a length equal to the largest side of its bounding box. Blends 4 views and, by plain ULR, 4
// captured lights.
Shot dollShot(const SurfelCloud& cloud, int width, int height, size_t lights);

// The shot with the renderer's preview setting.
Shot previewOf(Shot shot);

// A model with every `step`-th view, over the same files.
model::Model everyView(const model::Model& model, size_t step);

} // namespace surflect::bench
