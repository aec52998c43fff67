// Frames of a field whose images come from disk as they are needed: triangles of a plan, each with an image
// that is on the GPU.  [Domingo 2007, §4.1]
#pragma once

#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/image_cache.h"
#include "render/lightfield/spherical/pencil_weights.h"
#include "render/lightfield/spherical/spherical_frame.h"
#include "render/lightfield/spherical/visible_pencils.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace surflect::spherical {

// Plan of a frame: the triangles and images that it draws, before any image is loaded.
struct FramePlan {
  std::vector<WeightedTriangle> triangles; // in the order of drawing
  std::vector<ImageNumber> images; // of these triangles, each once, in the order of its first triangle
};

FramePlan planFrame(const DirectionTree& tree, const Window& window, const Look& look,
                    const Progress& progress = {});

// Work of a frame, by which its time is predicted.
struct FrameCounts {
  size_t triangles = 0;   // N_gpu: drawn
  size_t uploads = 0;     // N_main: images brought to the GPU
  size_t reads = 0;       // N_disk: images read from disk that the frame waited for
  size_t substituted = 0; // triangles that show an ancestor's image
  size_t batches = 0;     // draws, more than one if the frame's images do not fit on the GPU
};

// Draws triangles; their slots stay as they are during the call.
using DrawTriangles = std::function<void(std::span<const TexturedTriangle>)>;

// Draws all triangles of a plan with their own images, and waits until these are loaded. If the GPU cannot
// hold all, draws in batches, in the same order. Throws Error where an image cannot be read, and Cancelled.
FrameCounts drawAll(const FramePlan& plan, ImageCache& cache, const DrawTriangles& draw,
                    const Progress& progress = {});

// Draws all triangles of a plan without waiting: with images on the GPU, and at most `mostUploads` from main
// memory. Other triangles show their nearest ancestor's image on the GPU. Requests the images that are on
// disk. Throws Error where an image could not be read.
FrameCounts drawAtHand(const FramePlan& plan, ImageCache& cache, size_t mostUploads,
                       const DrawTriangles& draw);

// Work of drawAll() for a plan in the present state of the cache.
FrameCounts countsOf(const FramePlan& plan, const ImageCache& cache);

} // namespace surflect::spherical
