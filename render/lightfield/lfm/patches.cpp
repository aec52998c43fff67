#include "render/lightfield/lfm/patches.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

namespace surflect::lfm {

Observe observeIn(const lightfield::Sight& sight, const TriangleMesh& mesh, const SmoothNormals& normals) {
  return [&](uint32_t triangle, const Point3<AcquisitionSpace, double>& point) {
    if (!(areaVector(mesh, triangle).squaredNorm() > 0)) return std::vector<Observation>();
    return sight.observations(lightfield::surfacePoint(mesh, normals, triangle, point));
  };
}

namespace {

Point3<AcquisitionSpace, double> placeOf(const SeenLightField& field, uint32_t triangle, size_t sample) {
  const Vec3<double> weights = field.patch.barycentrics(sample);
  Vec3<double> place = Vec3<double>::Zero();
  for (size_t k = 0; k < 3; ++k)
    place += weights[static_cast<Eigen::Index>(k)] *
             field.mesh.positions[field.rings.corners()[triangle][k]].raw().cast<double>();
  return assume<Point3<AcquisitionSpace, double>>(place);
}

Patch patchOf(const SeenLightField& field, uint32_t triangle) {
  Patch patch;
  for (size_t sample = 0; sample < field.patch.samples(); ++sample) {
    const auto& seen = patch.samples.emplace_back(field.observe(triangle, placeOf(field, triangle, sample)));
    if (sample == 0)
      for (const Observation& o : seen) patch.wholeViews.push_back(o.photograph);
    std::erase_if(patch.wholeViews, [&](uint32_t p) {
      return !std::ranges::binary_search(seen, p, {}, &Observation::photograph);
    });
  }
  if (field.visible == Visible::triangle)
    for (std::vector<Observation>& observations : patch.samples)
      std::erase_if(observations, [&](const Observation& o) {
        return !std::ranges::binary_search(patch.wholeViews, o.photograph);
      });
  return patch;
}

} // namespace

void Patches::observe(std::span<const uint32_t> vertices, const Progress& progress) {
  std::vector<std::pair<uint32_t, Patch*>> missing;
  for (const uint32_t vertex : vertices)
    for (const RingTriangle& around : field_.rings.around(vertex))
      if (const auto [place, isNew] = held_.try_emplace(around.triangle); isNew)
        missing.emplace_back(around.triangle, &place->second);
  tbb::parallel_for(size_t{0}, missing.size(), [&](size_t i) {
    progress.checkpoint();
    *missing[i].second = patchOf(field_, missing[i].first);
  });
}

void Patches::release(std::span<const uint32_t> vertices) {
  for (const uint32_t vertex : vertices)
    for (const RingTriangle& around : field_.rings.around(vertex))
      if (++released_[around.triangle] == 3) held_.erase(around.triangle);
}

} // namespace surflect::lfm
