// Bytes of single maps, before tiles are made of them.
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/patch_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace surflect::lfm {

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
inline MapShape viewShape(const LightFieldMaps& maps) {
  return {MapShape::Kind::view, maps.viewSize, maps.channels};
}
inline MapShape meanShape(const LightFieldMaps& maps) {
  return {MapShape::Kind::patch, maps.samples, maps.channels};
}

// Value of a byte of a surface or view map; quantization.h has the inverse.
inline double valueOf(Method method, uint8_t byte) {
  return method == Method::pca ? std::max(static_cast<int8_t>(byte) / 127.0, -1.0) : byte / 255.0;
}

// Nearest byte of a mean map.
inline uint8_t meanByte(double root, double white) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(root / white, 0.0, 1.0)));
}

// Maps of coding `bytes`, all 0, with a map for each user.
LightFieldMaps emptyMaps(TriangleMesh mesh, std::vector<VertexFrame> frames, Method method, int samples,
                         int viewSize, size_t terms, size_t channels = 3);

// Removes maps of vertices whose scale is 0, and last terms whose scales are all 0; radiance does not change.
// Maps are packed and of coding `bytes`.
LightFieldMaps withoutZeros(LightFieldMaps maps);

// Table of the scalar layout for one that is packed: each corner has a map of its own, turned so that the
// corner comes first. Equal surfaces then have equal maps, whichever corner the triangle starts at.
MapTable scalarTable(const MapTable& packed, int samples);

} // namespace surflect::lfm
