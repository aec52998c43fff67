// The program's own look-up with one thing changed, for a given view of a bent model.
#pragma once

#include "bench/ablation/directions.h"
#include "bench/ablation/light_hull.h"
#include "render/evaluation/evaluate.h"

#include <functional>

namespace surflect::bench {

// A frame as renderFrame makes it, but for what a variant changes on the way.
struct SplatView {
  const model::Model& model;
  const warp::Warp& warp;
  capture::Camera<ObjectSpace> camera;
  surfels::FrameOptions options;
  codec::BlockCache& cache;
  Progress progress = {};
};

// Directions to viewer and lights go back by another map; where it has none, by the program's own.
evaluation::Renderer withDirections(const SplatView& view, DirectionsBack back);

// The rows of a plan anew: directional or point lights are blended over the light hull instead. The model is
// a full product of cameras and lights.
model::ShadingPlan blendedOverHull(const model::Model& model, const model::QueryBatch& batch,
                                   model::ShadingPlan plan);
evaluation::Renderer withLightHull(const SplatView& view);

// Both RGBA, premultiplied, of one size: the colours of the one, as opaque as the other, which has its own
// colours where the first has none.
image::Image underAlphaOf(const image::Image& colors, const image::Image& other);

} // namespace surflect::bench
