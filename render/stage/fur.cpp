#include "render/stage/fur.h"

#include "render/stage/random.h"
#include "render/stage/tube_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace surflect::stage {

using Vector = Vec3<double>;

Surface fur(const Surface& skin, const FurShape& shape) {
  constexpr int kSides = 5, kSteps = 8;
  const TriangleMesh& mesh = skin.mesh;
  std::vector<double> areas{0}; // cumulative, twice the area
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
    // Uniform point on the triangle: 1 - sqrt(u), sqrt(u) (1 - v), sqrt(u) v
    const double u = std::sqrt(random.next()), v = random.next();
    const std::array<double, 3> weights{1 - u, u * (1 - v), u * v};
    Vector root = Vector::Zero(), normal = Vector::Zero();
    Vec2<double> st(0, 0);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t corner = mesh.triangles[triangle][k];
      root += weights[k] * mesh.positions[corner].cast<double>().raw();
      normal += weights[k] * skin.normals[corner].raw();
      if (!skin.textureCoordinates.empty()) st += weights[k] * skin.textureCoordinates[corner];
    }
    normal.normalize();
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
    std::fill(surface.textureCoordinates.begin() + static_cast<std::ptrdiff_t>(first),
              surface.textureCoordinates.end(), st);
  }
  return surface;
}

} // namespace surflect::stage
