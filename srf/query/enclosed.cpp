#include "srf/query/enclosed.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>

namespace surflect {

namespace {

using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

constexpr size_t kVerticesPerTask = 1024;
constexpr double kSmall = 0.01; // of the mesh's diagonal: triangles told by their corners alone

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

double diagonalOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& p : mesh.positions) box.extend(p.cast<double>().raw());
  return box.diagonal().norm();
}

} // namespace

TriangleMesh withoutEnclosed(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
                             const Progress& progress) {
  // Means of the normals around the vertices, by area.
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t]) normals[vertex] += areaVector(mesh, t);
  std::vector<uint8_t> enclosed(mesh.positions.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, enclosed.size(), kVerticesPerTask),
                    [&](const tbb::blocked_range<size_t>& range) {
                      progress.checkpoint();
                      for (size_t v = range.begin(); v < range.end(); ++v)
                        enclosed[v] =
                            normals[v].squaredNorm() > 0 &&
                            isEnclosed(rays, mesh.positions[v].cast<double>(), normals[v].normalized());
                    });
  const double small = kSmall * diagonalOf(mesh);
  TriangleMesh open{mesh.positions, {}};
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    progress.checkNowAndThen(t);
    const auto& [a, b, c] = mesh.triangles[t];
    bool isInside = enclosed[a] && enclosed[b] && enclosed[c];
    if (isInside) {
      const Vec3<double> p = mesh.positions[a].cast<double>().raw(),
                         q = mesh.positions[b].cast<double>().raw(),
                         r = mesh.positions[c].cast<double>().raw();
      if (std::max({(p - q).norm(), (q - r).norm(), (r - p).norm()}) > small)
        isInside = isEnclosed(rays, assume<Point>((p + q + r) / 3), areaVector(mesh, t).normalized());
    }
    if (!isInside) open.triangles.push_back(mesh.triangles[t]);
  }
  return open.triangles.empty() ? mesh : open;
}

} // namespace surflect
