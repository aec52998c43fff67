#include "render/lightfield/lumigraph/depth_error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect::lumigraph {

namespace {

// Sums of one picture, to be added in order.
struct Sums {
  size_t lines = 0;
  double depth = 0, worstDepth = 0, offset = 0, worstOffset = 0;
};

Sums sumsOf(const Slab& slab, int i, int j, const RayCaster<AcquisitionSpace>& object,
            const RayCaster<AcquisitionSpace>& geometry, int step) {
  Sums sums;
  const double p = std::abs(slab.stPlane - slab.uvPlane);
  const double s = std::max(slab.stSpacing[0], slab.stSpacing[1]);
  for (int row = step / 2; row < slab.height; row += step)
    for (int column = step / 2; column < slab.width; column += step) {
      const Line line =
          slab.lineOf({static_cast<double>(i), static_cast<double>(j), column + 0.5, row + 0.5});
      const auto truth = object.firstHit(line.origin, line.direction),
                 found = geometry.firstHit(line.origin, line.direction);
      if (!truth || !found) continue;
      const double slant = std::abs(line.direction.raw()[slab.axis]); // depth along the line, per length
      const double d = truth->distance * slant, e = found->distance * slant - d;
      const double offset = std::abs(ghostOffset(p, e, s, d, slab.uvSpacing));
      ++sums.lines;
      sums.depth += std::abs(e), sums.worstDepth = std::max(sums.worstDepth, std::abs(e));
      sums.offset += offset, sums.worstOffset = std::max(sums.worstOffset, offset);
    }
  return sums;
}

} // namespace

DepthErrors depthErrors(const Slabs& slabs, const RayCaster<AcquisitionSpace>& object,
                        const TriangleMesh& geometry, int step, const Progress& progress) {
  assert(step >= 1);
  const RayCaster<AcquisitionSpace> simplified(geometry, progress);
  const int nodes = slabs[0].nodes;
  const auto ofSlab = static_cast<size_t>(nodes * nodes);
  std::vector<Sums> pictures(kSlabs * ofSlab);
  tbb::parallel_for(size_t{0}, pictures.size(), [&](size_t picture) {
    progress.checkpoint();
    const auto node = static_cast<int>(picture % ofSlab);
    pictures[picture] = sumsOf(slabs[picture / ofSlab], node % nodes, node / nodes, object, simplified, step);
  });
  DepthErrors errors;
  for (const Sums& sums : pictures) {
    errors.lines += sums.lines;
    errors.meanDepth += sums.depth, errors.meanOffset += sums.offset;
    errors.worstDepth = std::max(errors.worstDepth, sums.worstDepth);
    errors.worstOffset = std::max(errors.worstOffset, sums.worstOffset);
  }
  const auto lines = static_cast<double>(std::max<size_t>(1, errors.lines));
  errors.meanDepth /= lines, errors.meanOffset /= lines;
  return errors;
}

} // namespace surflect::lumigraph
