#include "srf/query/enclosed.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace surflect {

namespace {

using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

constexpr size_t kPerTask = 1024;

bool isEnclosed(const RayCaster<AcquisitionSpace>& rays, const Point& surface, const Vec3<double>& normal) {
  // All around, and along no edge of a tidy mesh.
  static const std::array<Direction, 6> probes = {
      normalized(Direction(0.811, 0.337, 0.479)),  normalized(Direction(-0.431, 0.859, 0.277)),
      normalized(Direction(0.283, -0.617, 0.733)), normalized(Direction(-0.709, -0.383, 0.593)),
      normalized(Direction(0.467, 0.251, -0.847)), normalized(Direction(-0.353, -0.547, -0.761))};
  const Point p = surface + assume<Direction>(4 * rays.selfHitOffset() * normal);
  // A ray into the open ends the search, and is the cheapest to ask for.
  const auto isBlocked = [&](const Direction& direction) {
    return rays.occluded(p, direction, 0, std::numeric_limits<double>::infinity());
  };
  const auto isInside = [&](const Direction& direction) { return rays.winding(p, direction) > 0; };
  return std::ranges::all_of(probes, isBlocked) && std::ranges::all_of(probes, isInside);
}

// All points of a triangle, `pitch` apart at most; its corners are known to be.
bool isEnclosedAll(const RayCaster<AcquisitionSpace>& rays, const TriangleMesh& mesh, size_t triangle,
                   double pitch, const Progress& progress) {
  const auto corner = [&](size_t i) -> Vec3<double> {
    return mesh.positions[mesh.triangles[triangle][i]].cast<double>().raw();
  };
  const Vec3<double> p = corner(0), q = corner(1) - p, r = corner(2) - p, normal = areaVector(mesh, triangle);
  if (!(normal.squaredNorm() > 0)) return true; // there is nothing of it
  const auto steps = static_cast<int>(std::ceil(std::max({q.norm(), r.norm(), (q - r).norm()}) / pitch));
  for (int i = 0; i <= steps; ++i) {
    progress.checkpoint();
    for (int j = 0; j <= steps - i; ++j)
      if (i % steps + j % steps > 0 &&
          !isEnclosed(rays, assume<Point>(p + (i * q + j * r) / steps), normal.normalized()))
        return false;
  }
  return true;
}

} // namespace

TriangleMesh withoutEnclosed(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays, double pitch,
                             const Progress& progress) {
  // Means of the normals around the vertices, by area.
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t]) normals[vertex] += areaVector(mesh, t);
  const auto forEach = [&](size_t count, const auto& work) {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kPerTask),
                      [&](const tbb::blocked_range<size_t>& range) {
                        progress.checkpoint();
                        for (size_t i = range.begin(); i < range.end(); ++i) work(i);
                      });
  };
  std::vector<uint8_t> isCornerInside(mesh.positions.size()), isInside(mesh.triangles.size());
  forEach(mesh.positions.size(), [&](size_t v) {
    isCornerInside[v] = normals[v].squaredNorm() > 0 &&
                        isEnclosed(rays, mesh.positions[v].cast<double>(), normals[v].normalized());
  });
  forEach(mesh.triangles.size(), [&](size_t t) {
    const auto& corners = mesh.triangles[t];
    isInside[t] = std::ranges::all_of(corners, [&](uint32_t v) { return isCornerInside[v] != 0; }) &&
                  isEnclosedAll(rays, mesh, t, pitch, progress);
  });
  TriangleMesh open{mesh.positions, {}};
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!isInside[t]) open.triangles.push_back(mesh.triangles[t]);
  return open.triangles.empty() ? mesh : open;
}

} // namespace surflect
