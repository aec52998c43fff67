#include "srf/query/light_table.h"

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

// About 48 cells from light to light, where n of them cover the sphere; fewer than 114 lights.
int cellsFor(size_t lights) {
  return std::clamp(static_cast<int>(48 * std::sqrt(static_cast<double>(lights))), 64, 512);
}

} // namespace

LightTable::LightTable(std::span<const Direction3<AcquisitionSpace, double>> lights, const LightBlend& how,
                       Uncovered uncovered)
    : cells_(cellsFor(lights.size())) {
  const LightCoverage coverage(lights);
  std::vector<Direction3<AcquisitionSpace>> towards;
  for (const auto& light : lights) towards.push_back(light.cast<float>());

  const int side = cells_ + 1;
  std::vector<BlendSet> vertices(static_cast<size_t>(side) * static_cast<size_t>(side));
  tbb::parallel_for(0, side, [&](int y) {
    const auto place = [&](int i) { return static_cast<float>(2 * i - cells_) / static_cast<float>(cells_); };
    for (int x = 0; x < side; ++x) {
      const auto direction = assume<Direction3<AcquisitionSpace>>(folded({place(x), place(y)}));
      vertices[static_cast<size_t>(y * side + x)] =
          blendOfLights(towards, direction, how, coverage, uncovered);
    }
  });

  for (int cell = 0; cell < cells_ * cells_; ++cell) {
    const size_t begin = shares_.size();
    first_.push_back(static_cast<uint32_t>(begin));
    for (int corner = 0; corner < 4; ++corner) {
      const int x = cell % cells_ + corner % 2, y = cell / cells_ + corner / 2;
      for (const auto& [light, weight] : vertices[static_cast<size_t>(y * side + x)]) {
        if (weight == 0) continue;
        auto share = std::find_if(shares_.begin() + static_cast<std::ptrdiff_t>(begin), shares_.end(),
                                  [&](const Share& other) { return other.light == light; });
        if (share == shares_.end()) share = shares_.insert(shares_.end(), {light, {}});
        share->atCorner[static_cast<size_t>(corner)] = weight;
      }
    }
  }
  first_.push_back(static_cast<uint32_t>(shares_.size()));
}

void LightTable::spread(std::span<const EnvironmentLight> environment,
                        const Turn<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment,
                        std::span<Eigen::Array4f> row, const Foreshortened* surface) const {
  const auto cells = static_cast<float>(cells_);
  for (const auto& [towards, irradiance] : environment) {
    const auto direction = acquisitionFromEnvironment(towards);
    const OnSquare place = unfolded(direction.raw());
    const float a = (place.a + 1) / 2 * cells, b = (place.b + 1) / 2 * cells;
    const int x = std::clamp(static_cast<int>(a), 0, cells_ - 1);
    const int y = std::clamp(static_cast<int>(b), 0, cells_ - 1);
    const float fx = a - static_cast<float>(x), fy = b - static_cast<float>(y);
    const std::array taps{(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    Eigen::Array4f light(irradiance.r, irradiance.g, irradiance.b,
                         irradiance.r + irradiance.g + irradiance.b);
    const auto cell = static_cast<size_t>(y * cells_ + x);
    const auto forEachWeight = [&](const auto& use) {
      for (uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
        const auto& [captured, atCorner] = shares_[i];
        use(captured, (taps[0] * atCorner[0] + taps[1] * atCorner[1]) +
                          (taps[2] * atCorner[2] + taps[3] * atCorner[3]));
      }
    };
    if (surface) {
      float sum = 0, weights = 0;
      forEachWeight([&](uint32_t captured, float weight) {
        sum += weight * surface->cosines[captured];
        weights += weight;
      });
      light.head<3>() *=
          foreshortening(foreshortenedCosine(surface->normal, direction), weights > 0 ? sum / weights : 0);
    }
    forEachWeight([&](uint32_t captured, float weight) { row[captured] += weight * light; });
  }
}

} // namespace surflect
