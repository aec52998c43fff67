#include "srf/weights/light_table.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surflect::weights {

namespace {

// A point of the square [-1, 1]^2 onto which the sphere is unfolded: the octahedron |x| + |y| + |z| = 1 seen
// along z, with its lower half folded outwards. Edges meet as on the octahedron, so that interpolation over
// grid cells is continuous on the sphere.  [Praun, Hoppe 2003, Spherical Parametrization] The inverse is
// findCells of nearest_kernels.cpp.
struct OnSquare {
  float a, b;
};
Vec3<float> folded(OnSquare p) {
  const float z = 1 - std::abs(p.a) - std::abs(p.b);
  if (z >= 0) return Vec3<float>(p.a, p.b, z).normalized();
  return Vec3<float>(std::copysign(1 - std::abs(p.b), p.a), std::copysign(1 - std::abs(p.a), p.b), z)
      .normalized();
}

// Cells along a side: about 54 between neighbouring lights that cover the sphere evenly, fewer for 90 lights
// or more, as 512 is the maximum.
size_t cellsFor(size_t lights) {
  return static_cast<size_t>(std::clamp(54 * std::sqrt(static_cast<double>(lights)), 64., 512.));
}

} // namespace

LightTable::LightTable(std::span<const Direction3<AcquisitionSpace, double>> lights, const LightBlend& how,
                       LightExtrapolation extrapolation)
    : cells_(cellsFor(lights.size())) {
  const LightExtrapolationFade coverage(lights);
  std::vector<Direction3<AcquisitionSpace>> towards;
  for (const auto& light : lights) towards.push_back(light.cast<float>());

  const int cells = static_cast<int>(cells_), side = cells + 1;
  std::vector<BlendSet> vertices(static_cast<size_t>(side) * static_cast<size_t>(side));
  tbb::parallel_for(0, side, [&](int y) {
    const auto place = [&](int i) { return static_cast<float>(2 * i - cells) / static_cast<float>(cells); };
    for (int x = 0; x < side; ++x) {
      const auto direction = assume<Direction3<AcquisitionSpace>>(folded({place(x), place(y)}));
      vertices[static_cast<size_t>(y * side + x)] =
          blendOfLights(towards, direction, how, coverage, extrapolation);
    }
  });

  std::vector<uint32_t> here; // lights with weight at a corner of the current cell
  for (int cell = 0; cell < cells * cells; ++cell) {
    const size_t begin = shares_.size();
    first_.push_back(static_cast<uint32_t>(begin));
    here.clear();
    for (int corner = 0; corner < 4; ++corner) {
      const int x = cell % cells + corner % 2, y = cell / cells + corner / 2;
      for (const auto& [light, weight] : vertices[static_cast<size_t>(y * side + x)]) {
        if (weight == 0) continue;
        const auto place = static_cast<size_t>(std::ranges::find(here, light) - here.begin());
        if (place == here.size()) here.push_back(light);
        if (begin + place / 4 == shares_.size()) shares_.emplace_back();
        Shares& shares = shares_[begin + place / 4];
        shares.light[place % 4] = light;
        shares.atCorner[static_cast<size_t>(corner)][place % 4] = weight;
      }
    }
  }
  first_.push_back(static_cast<uint32_t>(shares_.size()));
}

EnvironmentDirections::EnvironmentDirections(std::span<const EnvironmentLight> lights)
    : lights_(lights), towards_((lights.size() + kQueryLanes - 1) / kQueryLanes * 3 * kQueryLanes, 1.f) {
  for (size_t i = 0; i < lights.size(); ++i) {
    float* const x = towards_.data() + i / kQueryLanes * 3 * kQueryLanes + i % kQueryLanes;
    x[0] = lights[i].towards.x();
    x[kQueryLanes] = lights[i].towards.y();
    x[2 * kQueryLanes] = lights[i].towards.z();
  }
}

void LightTable::spread(const EnvironmentDirections& environment,
                        const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment,
                        std::span<Eigen::Array4f> row, const Foreshortened* surface,
                        const ReachedParts* reached) const {
  constexpr size_t kGroupsAtOnce = 4, kAtOnce = kGroupsAtOnce * kQueryLanes;
  const Mat3<float> turn = acquisitionFromEnvironment.matrix();
  std::array<float, kAtOnce> cells, right, down;
  for (size_t begin = 0; begin < environment.lights_.size(); begin += kAtOnce) {
    const auto lights =
        environment.lights_.subspan(begin, std::min(kAtOnce, environment.lights_.size() - begin));
    findCells(environment.towards_.data() + 3 * begin, (lights.size() + kQueryLanes - 1) / kQueryLanes,
              turn.data(), cells_, cells.data(), right.data(), down.data());
    for (size_t i = 0; i < lights.size(); ++i) // prefetches the first shares of each
      __builtin_prefetch(shares_.data() + first_[static_cast<size_t>(cells[i])]);
    for (size_t i = 0; i < lights.size(); ++i) {
      const auto& [towards, irradiance, spread] = lights[i];
      const float x = right[i], y = down[i];
      const std::array taps{(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y};
      Eigen::Array4f light(irradiance.r, irradiance.g, irradiance.b,
                           irradiance.r + irradiance.g + irradiance.b);
      const auto cell = static_cast<size_t>(cells[i]);
      const auto forEachWeight = [&, from = shares_.data() + first_[cell],
                                  to = shares_.data() + first_[cell + 1]](const auto& use) {
        for (const Shares* shares = from; shares != to; ++shares) {
          const auto at = [&](size_t corner) {
            return taps[corner] *
                   Eigen::Map<const Eigen::Array4f, Eigen::Aligned16>(shares->atCorner[corner].data());
          };
          const Eigen::Array4f weights = (at(0) + at(2)) + (at(1) + at(3));
          for (Eigen::Index k = 0; k < 4; ++k) use(shares->light[static_cast<size_t>(k)], weights[k]);
        }
      };
      if (surface) {
        float sum = 0, weights = 0;
        forEachWeight([&](uint32_t captured, float weight) {
          sum += weight * surface->cosines[captured];
          weights += weight;
        });
        light.head<3>() *=
            foreshortening(foreshortenedCosine(surface->normal, acquisitionFromEnvironment(towards)),
                           weights > 0 ? sum / weights : 0);
      }
      if (reached) {
        ReachedPart part;
        forEachWeight([&](uint32_t captured, float weight) {
          part.add(weight, reached->cosines[captured], reached->states[captured]);
        });
        reached->parts[begin + i] = part.value();
      }
      forEachWeight([light, row](uint32_t captured, float weight) { row[captured] += weight * light; });
    }
  }
}

} // namespace surflect::weights
