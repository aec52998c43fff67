// A closed test surface with bumps.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace surflect::lightfield {

// A closed surface around the origin, of radius 1 + bump times a wave; it occludes itself where bump is
// large.
inline TriangleMesh bumpySphere(double bump, int slices = 48) {
  TriangleMesh mesh;
  const int stacks = slices / 2;
  for (int j = 0; j <= stacks; ++j)
    for (int i = 0; i < slices; ++i) {
      const double theta = std::numbers::pi * j / stacks, phi = 2 * std::numbers::pi * i / slices;
      const double radius = 1 + bump * std::sin(3 * theta) * std::cos(4 * phi) * std::sin(theta);
      mesh.positions.emplace_back(static_cast<float>(radius * std::sin(theta) * std::cos(phi)),
                                  static_cast<float>(radius * std::cos(theta)),
                                  static_cast<float>(-radius * std::sin(theta) * std::sin(phi)));
    }
  const auto vertex = [&](int j, int i) { return static_cast<uint32_t>(j * slices + i % slices); };
  for (int j = 0; j < stacks; ++j)
    for (int i = 0; i < slices; ++i) {
      if (j > 0) mesh.triangles.push_back({vertex(j, i), vertex(j + 1, i), vertex(j, i + 1)});
      if (j + 1 < stacks)
        mesh.triangles.push_back({vertex(j, i + 1), vertex(j + 1, i), vertex(j + 1, i + 1)});
    }
  return mesh;
}

} // namespace surflect::lightfield
