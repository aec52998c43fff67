#include "srf/proxy/mesh/mesh_sides.h"

#include "surfel/base/evenly_spaced.h"
#include "surfel/geometry/ray_caster.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surflect::proxy {

namespace {

using World = AcquisitionSpace;

constexpr size_t kTriangles = 16384, kOfPart = 4, kSideViews = 32;
constexpr double kGrazing = 0.1; // cosine

// How many cameras see a triangle, from the front and from the back.
struct Seen {
  int front = 0, back = 0;
};

Seen seen(const TriangleMesh& mesh, uint32_t triangle, std::span<const capture::Camera<World>> cameras,
          const RayCaster<World>& rays) {
  Vec3<double> middle = Vec3<double>::Zero();
  for (const uint32_t v : mesh.triangles[triangle]) middle += mesh.positions[v].cast<double>().raw() / 3;
  const auto p = assume<Point3<World, double>>(middle);
  const Vec3<double> normal = areaVector(mesh, triangle).stableNormalized();
  Seen seen;
  for (const capture::Camera<World>& camera : cameras) {
    const capture::Viewpoint<World> viewpoint(camera);
    const auto direction = viewpoint.towards(p);
    const double cosine = normal.dot(direction.raw());
    if (!(std::abs(cosine) > kGrazing)) continue;
    const auto pixel = camera.project(p);
    if (!pixel || !capture::contains(camera.lens, *pixel)) continue;
    if (rays.occluded(p, direction, 4 * rays.selfHitOffset(), viewpoint.distance(p))) continue;
    ++(cosine > 0 ? seen.front : seen.back);
  }
  return seen;
}

} // namespace

std::vector<SeenSides> seenSides(const TriangleMesh& mesh, const MeshParts& parts,
                                 const std::vector<bool>& asksAll,
                                 std::span<const capture::Camera<World>> cameras, const Progress& progress) {
  const RayCaster<World> rays(mesh, progress);
  std::vector<capture::Camera<World>> some;
  for (const size_t i : evenlySpaced(cameras.size(), kSideViews)) some.push_back(cameras[i]);
  std::vector<uint32_t> triangles;
  std::vector<std::span<const capture::Camera<World>>> asked; // #triangles
  std::vector<size_t> end;                                    // of each part's
  for (size_t part = 0; part < parts.parts.size(); ++part) {
    const std::vector<uint32_t>& all = parts.parts[part].triangles;
    for (const size_t i :
         evenlySpaced(all.size(), std::max(kOfPart, all.size() * kTriangles / mesh.triangles.size())))
      triangles.push_back(all[i]);
    end.push_back(triangles.size());
    asked.resize(triangles.size(), asksAll[part] ? cameras : some);
  }
  std::vector<Seen> ofTriangle(triangles.size());
  tbb::parallel_for(size_t{0}, triangles.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    ofTriangle[i] = seen(mesh, triangles[i], asked[i], rays);
  });

  std::vector<SeenSides> sides(parts.parts.size());
  for (size_t part = 0, i = 0; part < sides.size(); ++part)
    for (; i < end[part]; ++i) {
      const double area = areaVector(mesh, triangles[i]).norm() / 2, front = area * ofTriangle[i].front,
                   back = area * ofTriangle[i].back;
      const bool isAgainst = parts.isAgainst[triangles[i]] != 0;
      sides[part].front += front;
      sides[part].back += back;
      sides[part].frontAlike += isAgainst ? back : front;
      sides[part].backAlike += isAgainst ? front : back;
    }
  return sides;
}

} // namespace surflect::proxy
