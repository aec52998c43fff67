#include "render/lightfield/lumigraph/slab.h"

#include "surfel/base/error.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::lumigraph {

namespace {

struct Interval {
  double low = std::numeric_limits<double>::infinity(), high = -low;

  void extend(double x) { low = std::min(low, x), high = std::max(high, x); }
  double length() const { return high - low; }
};

Interval intersection(const Interval& a, const Interval& b) {
  return {std::max(a.low, b.low), std::min(a.high, b.high)};
}

// Places on one axis of the planes that a slab needs.
struct Extent {
  Interval st, uv;
};

// st: lines of slopes -M..M through any vertex. uv: lines from nodes to points (x, d) of a triangle, d below
// the st plane; p is the distance of the planes. Such a node is on the grid. The line through it meets the uv
// plane farthest out where the point is a vertex, as a projection keeps convexity. Besides, a node that
// counts for a line of slope m is at most a spacing h from it on the st plane. From x + m d + h, the line to
// the point meets the uv plane at x + m (d - p) + h (1 - p / d); from x - m d - h, on the other side of x.
// The linear terms are extreme at a vertex, the last one where d is.
Extent extentOf(const TriangleMesh& mesh, const Slab& slab, int uAxis, double slope) {
  Extent extent;
  const auto along = [&](const Point3<AcquisitionSpace>& p, int axis) {
    return static_cast<double>(p.raw()[axis]);
  };
  const auto depth = [&](const Point3<AcquisitionSpace>& p) {
    return slab.sign * (slab.stPlane - along(p, slab.axis));
  };
  for (const auto& p : mesh.positions)
    for (const double m : {-slope, slope}) extent.st.extend(along(p, uAxis) + m * depth(p));
  const double spacing = extent.st.length() / (slab.nodes - 1);
  const double planes = slab.sign * (slab.stPlane - slab.uvPlane);
  Interval byLine, byGrid;
  for (const auto& triangle : mesh.triangles) {
    Interval depths;
    for (const uint32_t corner : triangle) depths.extend(depth(mesh.positions[corner]));
    for (const uint32_t corner : triangle) {
      const double x = along(mesh.positions[corner], uAxis), d = depth(mesh.positions[corner]);
      for (const double extreme : {depths.low, depths.high})
        for (const double side : {-1., 1.})
          byLine.extend(x + side * (slope * (d - planes) + spacing * (1 - planes / extreme)));
      for (const double node : {extent.st.low, extent.st.high}) byGrid.extend(node + (x - node) * planes / d);
    }
  }
  extent.uv = intersection(byLine, byGrid);
  return extent;
}

// Texels that cover a length, with one more on each side for bilinear interpolation.
double texelsOver(double length, double spacing) { return std::ceil(length / spacing) + 2; }

void requireRange(std::string_view name, double value, double lowest, double highest) {
  if (!(value >= lowest && value <= highest))
    throw Error::mismatch(fmt::format("{}..{}", numberText(lowest), numberText(highest)), numberText(value))
        .at(name);
}

} // namespace

Point Slab::stPoint(double s, double t) const {
  Vec3<double> p;
  p[axis] = stPlane, p[uAxis()] = stLow[0] + s * stSpacing[0], p[vAxis()] = stLow[1] + t * stSpacing[1];
  return assume<Point>(p);
}

Point Slab::uvPoint(double u, double v) const {
  Vec3<double> p;
  p[axis] = uvPlane, p[uAxis()] = uvLow[0] + u * uvSpacing, p[vAxis()] = uvLow[1] + v * uvSpacing;
  return assume<Point>(p);
}

LineCoordinates Slab::coordinatesOf(const Point& a, const Point& b) const {
  const Vec3<double> p = a.raw(), d = (b - a).raw();
  assert(d[axis] != 0);
  const Vec3<double> st = p + (stPlane - p[axis]) / d[axis] * d;
  const Vec3<double> uv = p + (uvPlane - p[axis]) / d[axis] * d;
  return {(st[uAxis()] - stLow[0]) / stSpacing[0], (st[vAxis()] - stLow[1]) / stSpacing[1],
          (uv[uAxis()] - uvLow[0]) / uvSpacing, (uv[vAxis()] - uvLow[1]) / uvSpacing};
}

Line Slab::lineOf(const LineCoordinates& coordinates) const {
  const Point origin = stPoint(coordinates.s, coordinates.t);
  return {origin, normalized(uvPoint(coordinates.u, coordinates.v) - origin)};
}

Slabs slabsAround(const TriangleMesh& mesh, const SlabOptions& options) {
  requireRange("nodes", options.nodes, 2, kMostNodes);
  requireRange("distance", options.distance, 1.25, 1000);
  requireRange("overlap", options.overlap, 0, 1);
  requireRange("texels", static_cast<double>(options.texels), 1, static_cast<double>(kMostTexels));
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  const double radius = box.isEmpty() ? 0 : box.diagonal().norm() / 2;
  if (mesh.triangles.empty() || !(radius > 0 && std::isfinite(radius)))
    throw Error("found no extent, expected an object").at("mesh");

  Slabs slabs;
  std::array<std::array<Interval, 2>, kSlabs> uv;
  for (size_t i = 0; i < kSlabs; ++i) {
    Slab& slab = slabs[i];
    slab.axis = static_cast<int>(i / 2), slab.sign = i % 2 == 0 ? 1 : -1, slab.nodes = options.nodes;
    slab.uvPlane = box.center()[slab.axis];
    slab.stPlane = slab.uvPlane + slab.sign * options.distance * radius;
    for (size_t k = 0; k < 2; ++k) {
      const Extent extent = extentOf(mesh, slab, k == 0 ? slab.uAxis() : slab.vAxis(), 1 + options.overlap);
      slab.stLow[k] = extent.st.low, slab.stSpacing[k] = extent.st.length() / (slab.nodes - 1);
      uv[i][k] = extent.uv;
    }
  }
  const auto texelsAt = [&](double spacing) {
    double sum = 0;
    for (const auto& [width, height] : uv)
      sum += texelsOver(width.length(), spacing) * texelsOver(height.length(), spacing);
    return sum * options.nodes * options.nodes;
  };
  // The smallest spacing within the quota, by bisection: texelsAt() falls as the spacing grows.
  const auto quota = static_cast<double>(options.texels);
  double tooSmall = 0, spacing = 2 * radius;
  if (texelsAt(spacing) > quota)
    throw Error::mismatch(fmt::format("at least {}", texelsAt(spacing)), numberText(quota)).at("texels");
  for (int i = 0; i < 60; ++i)
    if (const double middle = (tooSmall + spacing) / 2; texelsAt(middle) > quota)
      tooSmall = middle;
    else
      spacing = middle;
  for (size_t i = 0; i < kSlabs; ++i) {
    Slab& slab = slabs[i];
    slab.uvSpacing = spacing;
    slab.width = static_cast<int>(texelsOver(uv[i][0].length(), spacing));
    slab.height = static_cast<int>(texelsOver(uv[i][1].length(), spacing));
    slab.uvLow[0] = (uv[i][0].low + uv[i][0].high - slab.width * spacing) / 2;
    slab.uvLow[1] = (uv[i][1].low + uv[i][1].high - slab.height * spacing) / 2;
  }
  return slabs;
}

double weightSlope(double overlap) { return std::min(1e30, (1 + overlap) / overlap); }

std::array<double, kSlabs> slabWeights(const Direction& towardsViewer, double overlap) {
  const Vec3<double> d = towardsViewer.raw();
  const double largest = d.cwiseAbs().maxCoeff();
  assert(largest > 0);
  std::array<double, kSlabs> weights{};
  const auto slabOf = [&](int axis) { return static_cast<size_t>(2 * axis + (d[axis] < 0 ? 1 : 0)); };
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (overlap == 0 && sum > 0) break;
    const double lack = (largest - std::abs(d[axis])) / largest;
    const double weight =
        overlap == 0 ? (lack == 0 ? 1. : 0.) : std::max(0., 1 - lack * weightSlope(overlap));
    weights[slabOf(axis)] = weight;
    sum += weight;
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

} // namespace surflect::lumigraph
