// The shot that is timed: the doll twisted, under point lights.
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

// Sees all of a cloud from the front (-y) and a little above.
capture::Camera<ObjectSpace> frontCamera(const SurfelCloud& cloud, int width, int height);

// The cloud twisted by 40 degrees around z over its largest side, seen by frontCamera, under point lights
// from all around; the mean of 4 views and 4 captured lights.
Shot dollShot(const SurfelCloud& cloud, int width, int height, size_t lights);

// Every `step`-th view of a model, over the same files.
model::Model everyView(const model::Model& model, size_t step);

} // namespace surflect::bench
