// Bytes of single maps, before tiles are made of them.
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/rings.h"
#include "surfel/geometry/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace surflect::lfm {

// Interpolation between the samples of a triangle.

// Place in the triangle whose corners start at the given one.
constexpr PatchPlace turned(int samplesPerEdge, PatchPlace place, size_t firstCorner) {
  const std::array<int, 3> steps{samplesPerEdge - 1 - place.i - place.j, place.i, place.j};
  return {steps[(firstCorner + 1) % 3], steps[(firstCorner + 2) % 3]};
}

// Linear interpolation between three neighbouring samples. On an edge of the triangle only the samples of the
// edge count.
struct PatchBlend {
  std::array<PatchPlace, 3> places;
  std::array<double, 3> weights;
};

// Blend at barycentrics b of corner 1 and c of corner 2, which are clamped to the triangle.
inline PatchBlend blendAt(int samplesPerEdge, double b, double c) {
  const int last = samplesPerEdge - 1;
  const double u = std::clamp(b, 0.0, 1.0) * last;
  const double v = std::clamp(c * last, 0.0, last - u);
  const int i = std::min(static_cast<int>(u), last - 1), j = std::min(static_cast<int>(v), last - 1 - i);
  const double x = u - i, y = v - j;
  // A cell at the edge between corners 1 and 2 has no half beyond it.
  if (x + y <= 1 || i + j == last - 1) return {{{{i, j}, {i + 1, j}, {i, j + 1}}}, {1 - x - y, x, y}};
  return {{{{i + 1, j + 1}, {i, j + 1}, {i + 1, j}}}, {x + y - 1, 1 - x, 1 - y}};
}

struct MapShape {
  enum class Kind { patch, view };
  Kind kind = Kind::patch;
  int size = 0;        // samples along a triangle's edge, or cells along a side
  size_t channels = 3; // bytes of a sample

  size_t texels() const {
    const auto side = static_cast<size_t>(size);
    return kind == Kind::patch ? PatchGrid::samples(size) : side * side;
  }
  size_t bytes() const { return channels * texels(); } // of a map
};

inline MapShape surfaceShape(const LightFieldMaps& maps) {
  return {MapShape::Kind::patch, maps.samples, maps.layout == SurfaceLayout::packed ? size_t{3} : size_t{1}};
}
// Cells along a side of a view map of a term.
inline int viewSizeOf(const LightFieldMaps& maps, size_t term) {
  return term == 0 ? maps.viewSize : maps.higherViewSize;
}
inline MapShape viewShape(const LightFieldMaps& maps, size_t term) {
  return {MapShape::Kind::view, viewSizeOf(maps, term), maps.channels};
}
inline MapShape meanShape(const LightFieldMaps& maps) {
  return {MapShape::Kind::patch, maps.samples, maps.channels};
}

// Value of a byte of a surface or view map; quantization.h has the inverse.
inline double valueOf(Factorization method, uint8_t byte) {
  return method == Factorization::pca ? std::max(static_cast<int8_t>(byte) / 127.0, -1.0) : byte / 255.0;
}

// Nearest byte of a mean map.
inline uint8_t meanByte(double root, double white) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(root / white, 0.0, 1.0)));
}

// Maps of coding `bytes`, all 0, with a map for each user.
LightFieldMaps emptyMaps(TriangleMesh mesh, std::vector<VertexFrame> frames, Factorization method,
                         int samples, int viewSize, size_t terms, size_t channels = 3);

// Removes maps of vertices whose scale is 0, and last terms whose scales are all 0; radiance does not change.
// Maps are packed and of coding `bytes`.
LightFieldMaps withoutZeros(LightFieldMaps maps);

// Packed maps of coding `bytes` whose view maps have `size` cells along a side from the second term on. A
// cell is the mean of the cells that it covers; maps are scaled so that the largest mean is 1 again. Throws
// Error if that is more than they have, and Cancelled.
LightFieldMaps withHigherViewSize(LightFieldMaps maps, int size, const Progress& progress = {});

// Table of the scalar layout for one that is packed: each corner has a map of its own, turned so that the
// corner comes first. Equal surfaces then have equal maps, whichever corner the triangle starts at.
MapTable scalarTable(const MapTable& packed, int samples);

// Triangles and samples of light field maps that fit the photographs.

// Pixels of a photograph per triangle: as many as a patch with 24 samples along an edge has samples.
// [Chen 2002, §6.1] has 314.
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
