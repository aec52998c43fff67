// The program's own look-up with one thing changed, for a given view of a bent model.
#pragma once

#include "bench/ablation/directions.h"
#include "bench/ablation/light_hull.h"
#include "render/evaluation/evaluate.h"

#include <functional>

namespace surflect {

// A frame as renderFrame makes it, but for what a variant changes on the way.
struct SplatView {
  const Model& model;
  const Warp& warp;
  Camera<ObjectSpace> camera;
  FrameOptions options;
  BlockCache& cache;
  Progress progress = {};
};

// Directions to viewer and lights go back by another map; where it has none, by the program's own.
Renderer withDirections(const SplatView& view, DirectionsBack back);

// The rows of a plan anew: directional or point lights are blended over the light hull instead. The model is
// a full product of cameras and lights.
ShadingPlan blendedOverHull(const Model& model, const QueryBatch& batch, ShadingPlan plan);
Renderer withLightHull(const SplatView& view);

// Both RGBA, premultiplied, of one size: the colours of the one, as opaque as the other, which has its own
// colours where the first has none.
Image underAlphaOf(const Image& colors, const Image& other);

} // namespace surflect
