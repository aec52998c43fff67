#include "srf/query/light_table.h"

#include "srf/query/ulr.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surflect {

namespace {

// The sphere unfolded onto the square [-1, 1]^2: the octahedron |x| + |y| + |z| = 1 seen along z, its lower
// half folded out over the edges. Edges meet as in the octahedron, so that a function that is interpolated
// over the cells of a grid is continuous on the sphere.  [Praun, Hoppe 2003, Spherical Parametrization]
struct OnSquare {
  float a, b;
};
OnSquare unfolded(const Vec3<float>& d) {
  const float scale = 1 / (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]));
  const float a = d[0] * scale, b = d[1] * scale;
  if (d[2] >= 0) return {a, b};
  return {std::copysign(1 - std::abs(b), a), std::copysign(1 - std::abs(a), b)};
}
Vec3<float> folded(OnSquare p) {
  const float z = 1 - std::abs(p.a) - std::abs(p.b);
  if (z >= 0) return Vec3<float>(p.a, p.b, z).normalized();
  return Vec3<float>(std::copysign(1 - std::abs(p.b), p.a), std::copysign(1 - std::abs(p.a), p.b), z)
      .normalized();
}

// 16 cells a light; n lights lie about sqrt(4 pi / n) apart.
int cellsFor(size_t lights) {
  return std::clamp(static_cast<int>(16 * std::sqrt(static_cast<double>(lights))), 32, 512);
}

} // namespace

Direction3<AcquisitionSpace> LightTable::vertexDirection(int x, int y) const {
  const auto place = [&](int i) { return static_cast<float>(2 * i - cells_) / static_cast<float>(cells_); };
  return assume<Direction3<AcquisitionSpace>>(folded({place(x), place(y)}));
}

LightTable::LightTable(std::span<const Direction3<AcquisitionSpace, double>> lights, size_t blended,
                       Uncovered uncovered)
    : cells_(cellsFor(lights.size())) {
  const LightCoverage coverage(lights);
  std::vector<Direction3<AcquisitionSpace>> towards;
  for (const auto& light : lights) towards.push_back(light.cast<float>());

  const int side = cells_ + 1;
  std::vector<BlendSet> ofVertex(static_cast<size_t>(side) * static_cast<size_t>(side));
  tbb::parallel_for(0, side, [&](int y) {
    for (int x = 0; x < side; ++x) {
      const auto direction = vertexDirection(x, y);
      NearestCandidates nearest(blended);
      for (uint32_t light = 0; light < towards.size(); ++light)
        nearest.offer({light, anglePenalty(towards[light], direction)});
      BlendSet blend = ulrWeights(nearest);
      if (uncovered == Uncovered::fade)
        for (auto& share : blend) share.weight *= coverage.at(nearest.sorted()[0].penalty);
      ofVertex[static_cast<size_t>(y * side + x)] = blend;
    }
  });
  for (const BlendSet& blend : ofVertex) {
    first_.push_back(static_cast<uint32_t>(shares_.size()));
    for (const auto& [light, weight] : blend)
      if (weight > 0) shares_.push_back({light, weight});
  }
  first_.push_back(static_cast<uint32_t>(shares_.size()));
}

void LightTable::spread(const Direction3<AcquisitionSpace>& towards, Rgb irradiance,
                        std::span<Rgb> row) const {
  const OnSquare place = unfolded(towards.raw());
  const auto cellOf = [&](float t) {
    const float along = (t + 1) / 2 * static_cast<float>(cells_);
    const int cell = std::clamp(static_cast<int>(along), 0, cells_ - 1);
    return std::pair(cell, along - static_cast<float>(cell));
  };
  const auto [x, fx] = cellOf(place.a);
  const auto [y, fy] = cellOf(place.b);
  const auto vertex = static_cast<size_t>(y * (cells_ + 1) + x);
  const auto addVertex = [&](size_t index, float tap) {
    for (uint32_t i = first_[index]; i < first_[index + 1]; ++i)
      row[shares_[i].light] = row[shares_[i].light] + tap * shares_[i].weight * irradiance;
  };
  addVertex(vertex, (1 - fx) * (1 - fy));
  addVertex(vertex + 1, fx * (1 - fy));
  addVertex(vertex + static_cast<size_t>(cells_) + 1, (1 - fx) * fy);
  addVertex(vertex + static_cast<size_t>(cells_) + 2, fx * fy);
}

} // namespace surflect
