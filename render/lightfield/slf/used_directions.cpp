#include "render/lightfield/slf/used_directions.h"

#include "render/lightfield/slf/blackout_cone.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace surflect::slf {

std::vector<uint8_t> usedDirections(const TriangleMesh& mesh, const Chart& chart,
                                    const DirectionMesh& directions) {
  const size_t count = directions.directions().size();
  std::vector<uint8_t> isInFront(count, 0), isUsed(count, 0);
  for (const uint32_t triangle : chart.meshTriangles) {
    const Vec3<double> area = areaVector(mesh, triangle);
    if (!(area.squaredNorm() > 0)) continue;
    const Vec3<double> normal = area.normalized();
    for (size_t i = 0; i < count; ++i)
      if (directions.directions()[i].raw().dot(normal) > -std::sin(kTurnOver)) isInFront[i] = 1;
  }
  // A direction between corners that are all behind is behind too.
  for (const auto& corners : directions.triangles())
    if (std::ranges::any_of(corners, [&](uint32_t corner) { return isInFront[corner] == 1; }))
      for (const uint32_t corner : corners) isUsed[corner] = 1;
  return isUsed;
}

} // namespace surflect::slf
