// Vertex light field matrices with a closed form: a glossy, textured patch under two lights.
#pragma once

#include "render/lightfield/lfm/factors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::lfm {

// A matrix with the numbers that it refers to.
struct GlossyMatrix {
  size_t samples = 0, cells = 0;
  std::vector<float> radiance, weights; // weights: empty, all are 1
  LightFieldMatrix view() const { return {samples, cells, radiance, weights}; }
};

// Samples on a disc, times the hat function 1 - radius; cells of a square grid, all of them observed, whose
// directions are those of the unit disc where they are in it. Lobes widen with the texture's darkness and
// turn with the normal, which is that of a gentle bump.
inline GlossyMatrix glossyMatrix(size_t samples, int grid, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  GlossyMatrix matrix{samples, static_cast<size_t>(grid) * static_cast<size_t>(grid), {}, {}};
  for (size_t i = 0; i < samples; ++i) {
    const double radius = std::sqrt((static_cast<double>(i) + 0.5) / static_cast<double>(samples));
    const double angle = std::numbers::phi * 2 * std::numbers::pi * static_cast<double>(i);
    const double x = radius * std::cos(angle), y = radius * std::sin(angle), hat = 1 - radius;
    const double wave = 0.5 + 0.5 * std::sin(7 * x + 3 * y) * std::cos(5 * y) + 0.05 * uniform(random);
    const double diffuse[3] = {0.1 + 0.5 * wave, 0.15 + 0.2 * x * x + 0.2 * wave, 0.4 - 0.3 * wave};
    const double power = 8 + 40 * wave, nx = 0.3 * x, ny = 0.3 * y;
    for (int j = 0; j < grid; ++j)
      for (int k = 0; k < grid; ++k) {
        const double dx = 2 * (k + 0.5) / grid - 1, dy = 2 * (j + 0.5) / grid - 1;
        const double dz = std::sqrt(std::max(0.0, 1 - dx * dx - dy * dy));
        const auto lobe = [&](double lx, double ly) {
          const double lz = std::sqrt(1 - lx * lx - ly * ly), scale = 1 / std::sqrt(1 + nx * nx + ny * ny);
          const double hx = dx + lx, hy = dy + ly, hz = dz + lz,
                       length = std::sqrt(hx * hx + hy * hy + hz * hz);
          return std::pow(std::max(0.0, (nx * hx + ny * hy + hz) * scale / length), power);
        };
        const double warm = 0.6 * lobe(0.4, 0.1), cold = 0.4 * lobe(-0.5, 0.3);
        const double specular[3] = {warm, 0.9 * warm + 0.6 * cold, 0.7 * warm + cold};
        for (int c = 0; c < 3; ++c)
          matrix.radiance.push_back(static_cast<float>(hat * (diffuse[c] + specular[c])));
      }
  }
  return matrix;
}

} // namespace surflect::lfm
