#include "render/stage/fur.h"

#include "render/stage/random.h"
#include "render/stage/sweep.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surflect {

using Vector = Vec3<double>;

Surface fur(const Surface& skin, const FurShape& shape) {
  constexpr int kSides = 5, kSteps = 8;
  const TriangleMesh& mesh = skin.mesh;
  std::vector<double> areas{0}; // sums, of twice the area
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    areas.push_back(areas.back() + areaVector(mesh, i).norm());
  requireFewTriangles(static_cast<size_t>(shape.hairs) * 2 * kSides * (kSteps + 1));

  Surface surface;
  for (int hair = 0; hair < shape.hairs; ++hair) {
    Random random{shape.seed, static_cast<uint64_t>(hair)};
    const double wanted = random.next() * areas.back();
    const auto triangle = std::min<size_t>(
        static_cast<size_t>(std::upper_bound(areas.begin(), areas.end(), wanted) - areas.begin() - 1),
        mesh.triangles.size() - 1);
    const auto& [a, b, c] = mesh.triangles[triangle];
    // Even over the triangle: (1 - sqrt(u), sqrt(u)(1 - v), sqrt(u) v)
    const double u = std::sqrt(random.next()), v = random.next();
    const auto mean = [&](const auto& values) {
      return ((1 - u) * values[a] + u * (1 - v) * values[b] + u * v * values[c]).eval();
    };
    const auto corner = [&](uint32_t i) -> Vector { return mesh.positions[i].cast<double>().raw(); };
    const Vector root = (1 - u) * corner(a) + u * (1 - v) * corner(b) + u * v * corner(c);
    const Vector normal = ((1 - u) * skin.normals[a].raw() + u * (1 - v) * skin.normals[b].raw() +
                           u * v * skin.normals[c].raw())
                              .normalized();
    const double z = 2 * random.next() - 1, phi = 2 * std::numbers::pi * random.next();
    const double r = std::sqrt(1 - z * z);
    const Vector sideways(r * std::cos(phi), r * std::sin(phi), z);
    const Vector leaving = (normal + 0.7 * shape.disorder * sideways).normalized();
    const double length = shape.length * (1 - 0.5 * shape.disorder * random.next());
    const Vector comb = shape.comb + 0.3 * shape.disorder * sideways;

    std::vector<CurvePoint> points;
    for (int k = 0; k <= kSteps; ++k) {
      const double l = static_cast<double>(k) / kSteps;
      points.push_back({root + length * (l * leaving + l * l * comb), shape.radius * (1 - l)});
    }
    const size_t first = surface.mesh.positions.size();
    addTube(surface, points, false, kSides);
    if (skin.textureCoordinates.empty()) continue;
    std::fill(surface.textureCoordinates.begin() + static_cast<std::ptrdiff_t>(first),
              surface.textureCoordinates.end(), mean(skin.textureCoordinates));
  }
  return surface;
}

} // namespace surflect
