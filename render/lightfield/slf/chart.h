// Chart: a texture region of the mesh, flattened into a rectangle of texels.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {

// A connected part of the mesh, homeomorphic to a disc, with texture coordinates.
struct Chart {
  std::vector<uint32_t> vertices;       // of the mesh, each once
  std::vector<Vec2<float>> coordinates; // (u, v) of each vertex, 0..1 across the texture; texel (i, j)
                                        // is centred at ((i + 1/2) / width, (j + 1/2) / height)
  std::vector<std::array<uint32_t, 3>>
      triangles;                       // indices into vertices, counter-clockwise seen from outside
  std::vector<uint32_t> meshTriangles; // the mesh's triangle of each
  int width = 0, height = 0;           // texels

  size_t texels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

} // namespace surflect::slf
