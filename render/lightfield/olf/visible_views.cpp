#include "render/lightfield/olf/visible_views.h"

#include <tbb/parallel_for.h>

#include <array>
#include <numeric>
#include <utility>

namespace surflect::olf {

namespace {

using Point = Point3<AcquisitionSpace, double>;

enum class Sighting : uint8_t { hidden, held, seen }; // held: in the picture, but not seen

// Barycentrics of the points that are tried: slightly inside, so that neighbours do not occlude them.
constexpr double kNear = 0.04;
constexpr std::array<std::array<double, 3>, 7> kTried{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                                       {1 - 2 * kNear, kNear, kNear},
                                                       {kNear, 1 - 2 * kNear, kNear},
                                                       {kNear, kNear, 1 - 2 * kNear},
                                                       {kNear, 0.5 - kNear / 2, 0.5 - kNear / 2},
                                                       {0.5 - kNear / 2, kNear, 0.5 - kNear / 2},
                                                       {0.5 - kNear / 2, 0.5 - kNear / 2, kNear}}};

Sighting sightingOf(const TriangleMesh& mesh, size_t triangle,
                    const capture::Camera<AcquisitionSpace>& camera,
                    const RayCaster<AcquisitionSpace>& rays) {
  const Point center = camera.center();
  std::array<Vec3<double>, 3> corners;
  for (size_t i = 0; i < 3; ++i) {
    const Point p = mesh.positions[mesh.triangles[triangle][i]].cast<double>();
    const auto pixel = camera.project(p);
    if (!pixel || !capture::contains(camera.lens, *pixel)) return Sighting::hidden;
    corners[i] = p.raw();
  }
  if (!(areaVector(mesh, triangle).dot(center.raw() - corners[0]) > 0)) return Sighting::held;
  for (const auto& [a, b, c] : kTried) {
    const Point p = assume<Point>(Vec3<double>(a * corners[0] + b * corners[1] + c * corners[2]));
    const auto towards = center - p;
    if (rays.occluded(p, normalized(towards), rays.selfHitOffset(), length(towards))) return Sighting::held;
  }
  return Sighting::seen;
}

} // namespace

VisibleViews visibleViews(const lightfield::Views& views, std::span<const size_t> training,
                          const lfm::Rings& rings, Visible rule, const Progress& progress) {
  const TriangleMesh& mesh = views.mesh();
  std::vector<std::vector<uint32_t>> seen(mesh.positions.size()), facing(mesh.positions.size());
  std::vector<Sighting> sightings(mesh.triangles.size());
  for (uint32_t view = 0; view < training.size(); ++view) {
    progress("visible views", static_cast<double>(view) / static_cast<double>(training.size()));
    const capture::Camera<AcquisitionSpace>& camera = views.camera(training[view]);
    tbb::parallel_for(size_t{0}, sightings.size(),
                      [&](size_t t) { sightings[t] = sightingOf(mesh, t, camera, views.rays()); });
    for (const uint32_t vertex : rings.vertices()) {
      bool isHeld = true, isSeen = true;
      for (const lfm::RingTriangle& around : rings.around(vertex)) {
        isHeld &= sightings[around.triangle] != Sighting::hidden;
        isSeen &= sightings[around.triangle] == Sighting::seen;
      }
      if (isHeld && (isSeen || rule == Visible::all)) seen[vertex].push_back(view);
      const Vec3<double> towards = camera.center().raw() - mesh.positions[vertex].cast<double>().raw();
      if (isHeld && rings.frame(vertex).z.dot(towards) > 0) facing[vertex].push_back(view);
    }
  }
  VisibleViews visible;
  visible.first.push_back(0);
  std::vector<uint8_t> isUsed(mesh.positions.size(), 0);
  for (const uint32_t vertex : rings.vertices()) isUsed[vertex] = 1;
  for (size_t vertex = 0; vertex < seen.size(); ++vertex) {
    std::vector<uint32_t>& of = seen[vertex];
    if (of.empty() && isUsed[vertex]) {
      ++visible.unseenVertices;
      of = std::move(facing[vertex]);
      if (of.empty()) {
        of.resize(training.size());
        std::iota(of.begin(), of.end(), 0u);
      }
    }
    visible.views.insert(visible.views.end(), of.begin(), of.end());
    visible.first.push_back(static_cast<uint32_t>(visible.views.size()));
  }
  return visible;
}

} // namespace surflect::olf
