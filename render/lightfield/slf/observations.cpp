#include "render/lightfield/slf/observations.h"

#include <tbb/parallel_for.h>

namespace surflect::slf {

Observations::Observations(std::span<const TexelPoint> points, const TriangleMesh& mesh,
                           const SmoothNormals& normals, const lightfield::Sight& sight) {
  std::vector<std::vector<Observation>> seen(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t texel) {
    const TexelPoint& point = points[texel];
    if (point.meshTriangle != TexelPoint::kNone)
      seen[texel] =
          sight.observations(lightfield::surfacePoint(mesh, normals, point.meshTriangle, point.position));
  });
  first_.push_back(0);
  for (const std::vector<Observation>& observations : seen) {
    all_.insert(all_.end(), observations.begin(), observations.end());
    first_.push_back(all_.size());
  }
}

} // namespace surflect::slf
