#include "render/lightfield/slf/atlas_report.h"

#include "render/lightfield/slf/cone.h"
#include "render/lightfield/slf/stretch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace surflect::slf {

namespace {

using Corners = std::array<Vec2<double>, 3>;

// Corners of a triangle of a chart in texels; texel centres have whole coordinates.
Corners inTexels(const Chart& chart, const std::array<uint32_t, 3>& triangle) {
  Corners corners;
  for (size_t k = 0; k < 3; ++k) {
    const Vec2<double> p = chart.coordinates[triangle[k]].cast<double>();
    corners[k] = {p.x() * chart.width - 0.5, p.y() * chart.height - 0.5};
  }
  return corners;
}

// Does a triangle reach into the open square of half side 1 about a point? By separating axes.
bool meetsSquare(const Corners& corners, const Vec2<double>& middle) {
  const auto isApart = [&](const Vec2<double>& axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vec2<double>& p : corners) {
      const double along = axis.dot(p - middle);
      low = std::min(low, along), high = std::max(high, along);
    }
    const double reach = std::abs(axis.x()) + std::abs(axis.y());
    return !(low < reach && high > -reach);
  };
  if (isApart({1, 0}) || isApart({0, 1})) return false;
  for (size_t k = 0; k < 3; ++k) {
    const Vec2<double> edge = corners[(k + 1) % 3] - corners[k];
    if (isApart({-edge.y(), edge.x()})) return false;
  }
  return true;
}

struct Stretch {
  double largest, area; // of a triangle; [Sander 2001, Gamma]
};

// Least bound of the largest stretch on a share of the surface.
double boundOf(std::vector<Stretch> stretches, double share) {
  std::ranges::sort(stretches, {}, &Stretch::largest);
  double area = 0, below = 0;
  for (const Stretch& stretch : stretches) area += stretch.area;
  for (const Stretch& stretch : stretches)
    if ((below += stretch.area) >= share * area) return stretch.largest;
  return 0;
}

} // namespace

size_t texelsInReach(const Chart& chart) {
  std::vector<uint8_t> isReached(chart.texels(), 0);
  for (const auto& triangle : chart.triangles) {
    const Corners corners = inTexels(chart, triangle);
    Vec2<double> low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
    Vec2<double> high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    const auto first = [](double x) { return std::max(0, static_cast<int>(std::floor(x))); };
    const auto last = [](double x, int side) { return std::min(side - 1, static_cast<int>(std::ceil(x))); };
    for (int y = first(low.y()); y <= last(high.y(), chart.height); ++y)
      for (int x = first(low.x()); x <= last(high.x(), chart.width); ++x) {
        uint8_t& reached =
            isReached[static_cast<size_t>(y) * static_cast<size_t>(chart.width) + static_cast<size_t>(x)];
        if (!reached) reached = meetsSquare(corners, {x, y});
      }
  }
  return static_cast<size_t>(std::ranges::count(isReached, 1));
}

AtlasReport atlasReport(const TriangleMesh& mesh, std::span<const Chart> charts, double texelSize,
                        const Progress& progress) {
  AtlasReport report;
  report.regions = charts.size();
  double area = 0, planeAreas = 0, squares = 0, cones = 0;
  std::vector<Stretch> stretches;
  double smallestArea = std::numeric_limits<double>::infinity(), largestArea = 0;
  for (const Chart& chart : charts) {
    progress.checkpoint();
    double own = 0;
    for (const auto& triangle : chart.triangles) {
      std::array<Vec3<double>, 3> q;
      for (size_t k = 0; k < 3; ++k) q[k] = mesh.positions[chart.vertices[triangle[k]]].cast<double>().raw();
      const Corners p = inTexels(chart, triangle);
      const Metric metric = metricOf(q, p);
      const double triangleArea = (q[1] - q[0]).cross(q[2] - q[0]).norm() / 2;
      own += triangleArea;
      planeAreas += planeArea(p[0], p[1], p[2]);
      squares += triangleArea * metric.meanSquare();
      if (triangleArea > 0) stretches.push_back({metric.largest(), triangleArea});
    }
    const double cone = normalCone(mesh, chart.meshTriangles).halfAngle.degrees();
    report.worstCone = std::max(report.worstCone, cone);
    cones += own * cone;
    area += own;
    smallestArea = std::min(smallestArea, own), largestArea = std::max(largestArea, own);
    report.texels += chart.texels();
    report.texelsNeeded += texelsInReach(chart);
  }
  if (!(area > 0)) return report;
  const double mean = area / static_cast<double>(charts.size());
  report.meanCone = cones / area;
  report.smallestShare = smallestArea / mean, report.largestShare = largestArea / mean;
  report.meanStretch = std::sqrt(squares / area * planeAreas / area);
  report.highStretch = boundOf(std::move(stretches), 0.99) * std::sqrt(planeAreas / area);
  report.redundancy = static_cast<double>(report.texels) / static_cast<double>(report.texelsNeeded);
  report.cost = static_cast<double>(report.texels) * texelSize * texelSize / area;
  return report;
}

} // namespace surflect::slf
