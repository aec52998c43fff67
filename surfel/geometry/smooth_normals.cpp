#include "surfel/geometry/smooth_normals.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <cassert>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>

namespace surflect {

namespace {

constexpr size_t kMostAround = 256; // limits the quadratic cost

Vec3<double> positionOf(const TriangleMesh& mesh, uint32_t vertex) {
  return mesh.positions[vertex].cast<double>().raw();
}

// Vertex of corner 3 t + k: corner k of triangle t.
uint32_t vertexOf(const TriangleMesh& mesh, size_t corner) { return mesh.triangles[corner / 3][corner % 3]; }

Vec3<double> shareOf(const TriangleMesh& mesh, size_t corner) {
  const auto& triangle = mesh.triangles[corner / 3];
  const Vec3<double> p = positionOf(mesh, triangle[corner % 3]);
  return normalShare(positionOf(mesh, triangle[(corner + 1) % 3]) - p,
                     positionOf(mesh, triangle[(corner + 2) % 3]) - p);
}

} // namespace

Vec3<double> normalShare(const Vec3<double>& d, const Vec3<double>& e) {
  const double lengths = d.squaredNorm() * e.squaredNorm();
  return lengths > 0 ? Vec3<double>(d.cross(e) / lengths) : Vec3<double>::Zero();
}

SmoothNormals::SmoothNormals(const TriangleMesh& mesh, const Progress& progress)
    : mesh_(mesh), corners_(mesh.triangles.size()) {
  const double leastCosine = std::cos(kCreaseAngle.radians());
  std::vector<Vec3<float>> facets(mesh.triangles.size()); // unit, or 0
  tbb::parallel_for(size_t{0}, facets.size(), [&](size_t t) {
    progress.checkNowAndThen(t);
    facets[t] = areaVector(mesh, t).stableNormalized().cast<float>();
  });

  // Corners sorted by position.
  std::vector<size_t> order(3 * mesh.triangles.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto placeOf = [&](size_t corner) {
    const auto& p = mesh.positions[vertexOf(mesh, corner)];
    return std::tuple(p.x(), p.y(), p.z());
  };
  tbb::parallel_sort(order, [&](size_t a, size_t b) {
    progress.checkNowAndThen(a);
    return std::tuple(placeOf(a), a) < std::tuple(placeOf(b), b);
  });
  std::vector<size_t> firstOfPlace;
  for (size_t i = 0; i < order.size(); ++i)
    if (i == 0 || placeOf(order[i]) != placeOf(order[i - 1])) firstOfPlace.push_back(i);
  firstOfPlace.push_back(order.size());

  tbb::parallel_for(size_t{1}, firstOfPlace.size(), [&](size_t place) {
    progress.checkNowAndThen(place);
    const auto around =
        std::span(order).subspan(firstOfPlace[place - 1], firstOfPlace[place] - firstOfPlace[place - 1]);
    const bool isFan = around.size() > kMostAround;
    std::vector<Vec3<double>> shares;
    for (const size_t corner : around) shares.push_back(shareOf(mesh, corner));
    for (const size_t corner : around) {
      const Vec3<double> own = facets[corner / 3].cast<double>();
      Vec3<double> sum = Vec3<double>::Zero();
      for (size_t i = 0; i < around.size() && !isFan; ++i)
        if (own.dot(facets[around[i] / 3].cast<double>()) >= leastCosine) sum += shares[i];
      const double length = sum.stableNorm();
      const bool isThere = length > 0 && std::isfinite(length);
      corners_[corner / 3][corner % 3] = (isThere ? Vec3<double>(sum / length) : own).cast<float>();
    }
  });
}

Vec3<double> SmoothNormals::at(size_t triangle, const Vec3<double>& p) const {
  const auto& [ia, ib, ic] = mesh_.triangles[triangle];
  const Vec3<double> a = positionOf(mesh_, ia), area = areaVector(mesh_, triangle);
  const Vec3<double> ab = positionOf(mesh_, ib) - a, ac = positionOf(mesh_, ic) - a;
  assert(area.squaredNorm() > 0);
  const double b = (p - a).cross(ac).dot(area), c = ab.cross(p - a).dot(area); // barycentrics times |area|^2
  const Vec3<double> weights = Vec3<double>(area.squaredNorm() - b - c, b, c).cwiseMax(0);
  Vec3<double> sum = Vec3<double>::Zero();
  for (size_t k = 0; k < 3; ++k) sum += weights[static_cast<int>(k)] * corners_[triangle][k].cast<double>();
  return sum.stableNormalized();
}

} // namespace surflect
