#include "render/lightfield/olf/opacity_hull.h"

#include "srf/proxy/hull/visual_hull.h"
#include "surfel/base/error.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/geometry/simplify.h"
#include "surfel/math/bounds.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

namespace surflect::olf {

namespace {

// The first vertex at the position of each.
std::vector<size_t> firstAtPosition(const TriangleMesh& mesh) {
  std::map<std::array<float, 3>, size_t> known;
  std::vector<size_t> first;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3<float> p = mesh.positions[i].raw();
    first.push_back(known.try_emplace({p[0], p[1], p[2]}, i).first->second);
  }
  return first;
}

// Area-weighted normals of vertices, those at one position as one; 0 where there is none.
std::vector<Vec3<double>> outwardNormals(const TriangleMesh& mesh, const std::vector<size_t>& first) {
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t corner : mesh.triangles[t]) normals[first[corner]] += areaVector(mesh, t);
  for (Vec3<double>& normal : normals)
    if (const double length = normal.norm(); length > 0) normal /= length;
  return normals;
}

image::Image touched(const image::Image& rgba) {
  image::Image mask(rgba.width, rgba.height, 1);
  for (int y = 0; y < rgba.height; ++y)
    for (int x = 0; x < rgba.width; ++x) {
      if (!(rgba.at(x, y)[3] > 0)) continue;
      for (int j = std::max(0, y - 1); j <= std::min(rgba.height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(rgba.width - 1, x + 1); ++i) mask.at(i, j)[0] = 1;
    }
  return mask;
}

} // namespace

TriangleMesh coarseAround(const TriangleMesh& mesh, size_t triangles) {
  if (triangles == 0 || triangles >= mesh.triangles.size()) return mesh;
  TriangleMesh coarse = simplified(mesh, triangles);
  const double farthest = boundsOf(mesh.positions).diagonal().norm() / 20;
  const RayCaster<AcquisitionSpace> rays(coarse);
  const std::vector<size_t> first = firstAtPosition(coarse);
  const std::vector<Vec3<double>> outwards = outwardNormals(mesh, firstAtPosition(mesh)),
                                  directions = outwardNormals(coarse, first);
  std::vector<double> heights(coarse.positions.size(), 0);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    if (outwards[i].isZero(0)) continue;
    const auto inwards = assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(-outwards[i]));
    const auto hit = rays.firstHit(mesh.positions[i].cast<double>(), inwards);
    if (!hit || hit->distance > farthest) continue;
    const double height = hit->distance * areaVector(coarse, hit->triangle).normalized().dot(outwards[i]);
    for (const uint32_t corner : coarse.triangles[hit->triangle])
      heights[first[corner]] = std::max(heights[first[corner]], height);
  }
  for (size_t i = 0; i < heights.size(); ++i)
    coarse.positions[i] = assume<Point3<AcquisitionSpace>>(
        Vec3<double>(coarse.positions[i].cast<double>().raw() + heights[first[i]] * directions[first[i]]));
  return coarse;
}

TriangleMesh opacityHull(const lightfield::Views& views, const Progress& progress) {
  std::vector<hull::SilhouetteView> silhouettes;
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  for (size_t i = 0; i < training.size(); ++i) {
    progress("silhouettes", static_cast<double>(i) / static_cast<double>(training.size()));
    const image::Image mask = touched(views.read(training[i], {{}, progress.cancelled}));
    if (std::ranges::find(mask.values, 0.f) != mask.values.end())
      silhouettes.push_back({views.name(training[i]), views.camera(training[i]), hull::Outline(mask)});
  }
  if (silhouettes.size() < 2)
    throw Error("no opacity hull: fewer than two views show background").in(views.capture().file);
  try {
    return hull::visualHull(silhouettes, {}, progress).mesh;
  } catch (Error& error) {
    throw std::move(error).in(views.capture().file);
  }
}

bool replaceMesh(lightfield::Views& views, const MeshChoice& choice, const Progress& progress) {
  const bool isHull = choice.hull || views.geometry().origin == proxy::Impostor::Origin::hull;
  if (isHull) views.replaceMesh(opacityHull(views, progress), progress);
  if (choice.triangles > 0)
    views.replaceMesh(withoutUnused(withoutFlat(coarseAround(views.mesh(), choice.triangles), progress)),
                      progress);
  return isHull;
}

} // namespace surflect::olf
