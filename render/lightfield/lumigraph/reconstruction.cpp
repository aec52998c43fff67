#include "render/lightfield/lumigraph/reconstruction.h"

#include "srf/image/half_float.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace surflect::lumigraph {

namespace {

// Two neighbours on a grid of `count` places, and the share of the second.
struct Between {
  int first = 0, second = 0;
  double share = 0;
};

Between between(double place, int count) {
  const double within = std::clamp(place, 0., static_cast<double>(count - 1));
  const int first = std::min(static_cast<int>(within), count - 1);
  return {first, std::min(first + 1, count - 1), within - first};
}

} // namespace

std::vector<Tap> tapsAt(const Slabs& slabs, double overlap, const Point& p, const Point& viewer) {
  std::vector<Tap> taps;
  const Direction towards = viewer - p;
  if (towards.raw().isZero(0)) return taps;
  const std::array<double, kSlabs> weights = slabWeights(towards, overlap);
  for (size_t k = 0; k < kSlabs; ++k) {
    if (!(weights[k] > 0)) continue;
    const LineCoordinates line = slabs[k].coordinatesOf(p, viewer);
    const Between s = between(line.s, slabs[k].nodes), t = between(line.t, slabs[k].nodes);
    for (const auto& [j, rowWeight] : {std::pair(t.first, 1 - t.share), {t.second, t.share}})
      for (const auto& [i, columnWeight] : {std::pair(s.first, 1 - s.share), {s.second, s.share}}) {
        const double weight = weights[k] * rowWeight * columnWeight;
        if (!(weight > 0)) continue;
        const LineCoordinates corrected = slabs[k].coordinatesOf(p, slabs[k].stPoint(i, j));
        taps.push_back({k, i, j, corrected.u, corrected.v, weight});
      }
  }
  return taps;
}

Eigen::Vector4d textureAt(const Lumigraph& lumigraph, const Tap& tap) {
  const Slab& slab = lumigraph.slabs[tap.slab];
  const std::span<const Texel> picture = lumigraph.picture(tap.slab, tap.i, tap.j);
  const Between columns = between(tap.u - 0.5, slab.width), rows = between(tap.v - 0.5, slab.height);
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const auto& [y, rowWeight] : {std::pair(rows.first, 1 - rows.share), {rows.second, rows.share}})
    for (const auto& [x, weight] :
         {std::pair(columns.first, 1 - columns.share), {columns.second, columns.share}}) {
      const Texel& texel = picture[static_cast<size_t>(y) * slab.width + x];
      for (int channel = 0; channel < 4; ++channel)
        sum[channel] += rowWeight * weight * static_cast<double>(image::floatOfHalf(texel[channel]));
    }
  return sum;
}

Eigen::Vector4d radianceAt(const Lumigraph& lumigraph, const Point& p, const Point& viewer) {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  double weights = 0, alpha = 0;
  for (const Tap& tap : tapsAt(lumigraph.slabs, lumigraph.overlap, p, viewer)) {
    const Eigen::Vector4d texel = textureAt(lumigraph, tap);
    const double weight = tap.weight * (texel[3] + kFilledWeight);
    color += weight * texel.head<3>();
    weights += weight;
    alpha += tap.weight * texel[3];
  }
  if (!(weights > 0)) return Eigen::Vector4d::Zero();
  if (lumigraph.geometry.exactOutline) alpha = 1;
  Eigen::Vector4d result;
  result << alpha / weights * color, alpha;
  return result;
}

} // namespace surflect::lumigraph
