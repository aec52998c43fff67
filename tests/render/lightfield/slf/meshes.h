// Meshes for tests of texture regions.
#pragma once

#include "surfel/geometry/mesh.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace surflect::slf::testing {

using Triangles = std::vector<std::array<uint32_t, 3>>;

inline TriangleMesh meshOf(const std::vector<Vec3<double>>& positions, Triangles triangles) {
  TriangleMesh mesh{{}, std::move(triangles)};
  for (const Vec3<double>& p : positions) mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
  return mesh;
}

// One mesh of two, without common vertices.
inline TriangleMesh together(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const auto& [i, j, k] : b.triangles) a.triangles.push_back({first + i, first + j, first + k});
  return a;
}

// Unit square of n x n cells of two triangles in the plane z = 0, seen from +z.
inline TriangleMesh squarePatch(uint32_t n) {
  std::vector<Vec3<double>> positions;
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x) positions.emplace_back(Vec3<double>(x, y, 0) / n);
  Triangles triangles;
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, c = a + n + 1;
      triangles.push_back({a, a + 1, c + 1});
      triangles.push_back({a, c + 1, c});
    }
  return meshOf(positions, std::move(triangles));
}

// Closed sphere of 2 slices (stacks - 1) triangles, facing outwards, whose radius is 1 + bump times a wave.
inline TriangleMesh bumpySphere(uint32_t stacks, uint32_t slices, double bump = 0) {
  std::vector<Vec3<double>> positions;
  const auto add = [&](double theta, double phi) {
    const Vec3<double> direction(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                 std::cos(theta));
    const double wave =
        std::sin(7 * direction.x()) * std::sin(6 * direction.y() + 1) * std::sin(8 * direction.z() + 2);
    positions.push_back((1 + bump * wave) * direction);
  };
  add(0, 0);
  for (uint32_t i = 1; i < stacks; ++i)
    for (uint32_t j = 0; j < slices; ++j)
      add(std::numbers::pi * i / stacks, 2 * std::numbers::pi * j / slices);
  add(std::numbers::pi, 0);
  const auto at = [&](uint32_t stack, uint32_t slice) { return 1 + (stack - 1) * slices + slice % slices; };
  const auto last = static_cast<uint32_t>(positions.size() - 1);
  Triangles triangles;
  for (uint32_t j = 0; j < slices; ++j) {
    triangles.push_back({0, at(1, j), at(1, j + 1)});
    triangles.push_back({last, at(stacks - 1, j + 1), at(stacks - 1, j)});
    for (uint32_t i = 1; i + 1 < stacks; ++i) {
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return meshOf(positions, std::move(triangles));
}

// Closed torus of 2 n m triangles about the z axis, facing outwards.
inline TriangleMesh torus(uint32_t n, uint32_t m) {
  std::vector<Vec3<double>> positions;
  Triangles triangles;
  for (uint32_t i = 0; i < n; ++i)
    for (uint32_t j = 0; j < m; ++j) {
      const double a = 2 * std::numbers::pi * i / n, b = 2 * std::numbers::pi * j / m;
      const double radius = 1 + 0.4 * std::cos(b);
      positions.emplace_back(radius * std::cos(a), radius * std::sin(a), 0.4 * std::sin(b));
      const auto at = [&](uint32_t k, uint32_t l) { return k % n * m + l % m; };
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return meshOf(positions, std::move(triangles));
}

// Mesh whose vertices are moved by up to `distance` along each axis.
inline TriangleMesh shaken(TriangleMesh mesh, float distance, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> move(-distance, distance);
  for (auto& p : mesh.positions) p = {p.x() + move(random), p.y() + move(random), p.z() + move(random)};
  return mesh;
}

} // namespace surflect::slf::testing
