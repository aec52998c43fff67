// Synthetic inputs for codec tests: small, seeded, and chosen to be difficult.
#pragma once

#include "srf/codec/view_encoder.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <vector>

namespace surflect::codec::synthetic {

inline Eigen::MatrixXf random(int rows, int columns, std::mt19937& generator) {
  std::normal_distribution<float> normal;
  return Eigen::MatrixXf::NullaryExpr(rows, columns, [&] { return normal(generator); });
}

// A textured sphere with a highlight, under lights spread over the viewer's hemisphere. Linear radiance:
// diffuse white is 1, highlights reach 1 + `gloss`.
inline codec::ReflectanceStack glossySphere(int size, int lights, float gloss = 2, float exponent = 60) {
  codec::ReflectanceStack stack{size, size, std::vector<image::Image>(lights, image::Image(size, size, 3)),
                                image::Image(size, size, 1)};
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float nx = 2.2f * ((static_cast<float>(x) + 0.5f) / static_cast<float>(size) - 0.5f);
      const float ny = 2.2f * (0.5f - (static_cast<float>(y) + 0.5f) / static_cast<float>(size));
      if (nx * nx + ny * ny >= 1) continue;
      stack.alpha.at(x, y)[0] = 1;
      const float nz = std::sqrt(1 - nx * nx - ny * ny);
      const float albedo = 0.5f + 0.3f * std::sin(20 * nx) * std::sin(17 * ny + 3 * nx);
      for (int l = 0; l < lights; ++l) {
        const float lz = (static_cast<float>(l) + 0.5f) / static_cast<float>(lights);
        const float r = std::sqrt(1 - lz * lz), turn = 2.39996f * static_cast<float>(l);
        const float lx = r * std::cos(turn), ly = r * std::sin(turn);
        const float diffuse = std::max(0.f, nx * lx + ny * ly + nz * lz);
        const float half = std::sqrt(lx * lx + ly * ly + (lz + 1) * (lz + 1));
        const float shine =
            gloss * std::pow(std::max(0.f, (nx * lx + ny * ly + nz * (lz + 1)) / half), exponent);
        const auto pixel = stack.lights[l].at(x, y);
        pixel[0] = albedo * diffuse + shine;
        pixel[1] = 0.7f * albedo * albedo * diffuse + shine;
        pixel[2] = 0.5f * (1 - albedo) * diffuse + shine;
      }
    }
  }
  return stack;
}

} // namespace surflect::codec::synthetic
