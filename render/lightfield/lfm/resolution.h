// Triangles and samples of light field maps that fit the photographs.
#pragma once

#include "render/lightfield/common/views.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>

namespace surflect::lfm {

// Pixels of a photograph per triangle: as many as a patch with 24 samples along an edge has samples.
// [Chen et al. 2002, §6.1] has 314.
inline constexpr double kPixelsPerTriangle = 300;

struct Resolution {
  TriangleMesh mesh; // the views' mesh, simplified
  int samples = 0;   // along a triangle's edge
};

// Samples along an edge of the views' mesh: `samples`; if `samples` is 0, as many as a triangle's pixels
// need.
int samplesFor(const lightfield::Views& views, int samples);

// Mesh with `triangles` triangles; if `triangles` is 0, with kPixelsPerTriangle pixels for each, and more
// where fewer would move the surface by more than a pixel. Samples as samplesFor() gives them.
Resolution resolutionFor(const lightfield::Views& views, size_t triangles, int samples);

} // namespace surflect::lfm
