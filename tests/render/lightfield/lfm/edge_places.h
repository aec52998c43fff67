// Places on edges that two triangles share.
#pragma once

#include "render/lightfield/lfm/radiance.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace surflect::lfm::testing {

// Two triangles of a mesh at a common edge, and the same place in both.
struct EdgePlace {
  TrianglePlace a, b;
};

// Five random places on each edge; vertices of the triangles are welded.
inline std::vector<EdgePlace> edgePlaces(const TriangleMesh& mesh, std::mt19937& random) {
  std::map<std::pair<uint32_t, uint32_t>, std::pair<size_t, size_t>> edges; // triangle, corner
  std::vector<EdgePlace> places;
  const auto placeOn = [](size_t triangle, size_t corner, double share) {
    std::array<double, 3> weights{};
    weights[corner] = 1 - share, weights[(corner + 1) % 3] = share;
    return TrianglePlace{triangle, weights[1], weights[2]};
  };
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (size_t corner = 0; corner < 3; ++corner) {
      const uint32_t from = mesh.triangles[t][corner], to = mesh.triangles[t][(corner + 1) % 3];
      if (const auto other = edges.find({to, from}); other != edges.end())
        for (int i = 0; i < 5; ++i) {
          const double share = std::uniform_real_distribution<double>(0, 1)(random);
          places.push_back(
              {placeOn(t, corner, share), placeOn(other->second.first, other->second.second, 1 - share)});
        }
      edges[{from, to}] = {t, corner};
    }
  return places;
}

} // namespace surflect::lfm::testing
