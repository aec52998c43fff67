#include "render/lightfield/lfm/view_blend.h"

#include "render/lightfield/common/convex_hull.h"
#include "surfel/base/error.h"
#include "surfel/math/space.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace surflect::lfm {

ViewGrid::ViewGrid(int size) : size_(size) {
  if (size < 2 || size > kLargest)
    throw Error::mismatch("2 to " + std::to_string(kLargest), std::to_string(size)).at("grid");
}

DiscPoint ViewGrid::center(size_t cell) const {
  const size_t side = static_cast<size_t>(size_);
  return DiscPoint(static_cast<double>(cell % side) + 0.5, static_cast<double>(cell / side) + 0.5) / size_;
}

bool ViewGrid::isInDisc(size_t cell) const { return (2 * center(cell) - DiscPoint(1, 1)).squaredNorm() <= 1; }

std::vector<std::array<uint32_t, 3>> delaunayTriangles(std::span<const DiscPoint> sites) {
  DiscPoint middle = DiscPoint::Zero();
  for (const DiscPoint& p : sites) middle += p / static_cast<double>(sites.size());
  std::vector<Vec3<double>> lifted;
  for (const DiscPoint& p : sites) lifted.emplace_back(p[0], p[1], (p - middle).squaredNorm());
  // A point far above makes the hull solid even if all sites are on one circle.
  lifted.emplace_back(middle[0], middle[1], 4.0);
  const auto above = static_cast<uint32_t>(sites.size());
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const auto& [a, b, c] : lightfield::convexHull(lifted)) {
    if (a == above || b == above || c == above) continue;
    std::array<uint32_t, 3> corners{a, c, b}; // as seen from above
    if (!(doubledArea(sites[a], sites[c], sites[b]) > kLeastArea)) continue;
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    triangles.push_back(corners);
  }
  std::ranges::sort(triangles);
  return triangles;
}

namespace {

using Triangle = std::array<uint32_t, 3>;

// Edges of one triangle only, as they run in it.
std::vector<std::array<uint32_t, 2>> bordersOf(const std::vector<Triangle>& triangles) {
  std::vector<std::array<uint32_t, 2>> edges, borders;
  for (const Triangle& corners : triangles)
    for (size_t k = 0; k < 3; ++k) edges.push_back({corners[k], corners[(k + 1) % 3]});
  std::ranges::sort(edges);
  for (const auto& [from, to] : edges)
    if (!std::ranges::binary_search(edges, std::array{to, from})) borders.push_back({from, to});
  return borders;
}

// Segments between sites in their order along the line that fits them best.
std::vector<std::array<uint32_t, 2>> segmentsOf(std::span<const DiscPoint> sites) {
  DiscPoint mean = DiscPoint::Zero();
  for (const DiscPoint& p : sites) mean += p / static_cast<double>(sites.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const DiscPoint& p : sites) spread += (p - mean) * (p - mean).transpose();
  const DiscPoint along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  std::vector<uint32_t> order(sites.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, [&](uint32_t i) { return along.dot(sites[i]); });
  std::vector<std::array<uint32_t, 2>> segments;
  for (size_t i = 1; i < order.size(); ++i) segments.push_back({order[i - 1], order[i]});
  if (order.size() == 1) segments.push_back({order[0], order[0]});
  return segments;
}

// Barycentric coordinates down to this far below 0 count as in a triangle.
constexpr double kRounding = 1e-9;

// Barycentric coordinate of a corner as a linear function on the disc.
struct Barycentric {
  double offset, alongX, alongY;

  // 1 at `corner`, 0 on the line from b to c.
  Barycentric(const DiscPoint& corner, const DiscPoint& b, const DiscPoint& c) {
    const double area = doubledArea(corner, b, c);
    alongX = (b[1] - c[1]) / area;
    alongY = (c[0] - b[0]) / area;
    offset = 1 - alongX * corner[0] - alongY * corner[1];
  }
  double at(const DiscPoint& p) const { return offset + alongX * p[0] + alongY * p[1]; }
};

// Blends of the cells with centres in a triangle, unless they have one.
void coverCells(const Triangle& corners, std::span<const DiscPoint> sites, const ViewGrid& grid,
                std::vector<CellBlend>& blends, std::vector<uint8_t>& isCovered) {
  const DiscPoint &a = sites[corners[0]], &b = sites[corners[1]], &c = sites[corners[2]];
  const std::array<Barycentric, 3> barycentrics{Barycentric(a, b, c), Barycentric(b, c, a),
                                                Barycentric(c, a, b)};
  const int size = grid.size();
  const auto range = [&](Eigen::Index axis) {
    const auto [low, high] = std::minmax({a[axis], b[axis], c[axis]});
    return std::pair(
        static_cast<int>(std::clamp(std::ceil(low * size - 0.5 - kRounding), 0.0, size - 1.0)),
        static_cast<int>(std::clamp(std::floor(high * size - 0.5 + kRounding), 0.0, size - 1.0)));
  };
  const auto [left, right] = range(0);
  const auto [top, bottom] = range(1);
  for (int j = top; j <= bottom; ++j)
    for (int i = left; i <= right; ++i) {
      const size_t cell = static_cast<size_t>(j * size + i);
      if (isCovered[cell]) continue;
      const DiscPoint center = DiscPoint(i + 0.5, j + 0.5) / size;
      const Vec3<double> raw(barycentrics[0].at(center), barycentrics[1].at(center),
                             barycentrics[2].at(center));
      if (raw.minCoeff() < -kRounding) continue;
      const Vec3<double> weights = raw.cwiseMax(0) / raw.cwiseMax(0).sum();
      isCovered[cell] = 1;
      blends[cell] = {
          corners,
          {static_cast<float>(weights[0]), static_cast<float>(weights[1]), static_cast<float>(weights[2])},
          true};
    }
}

// Blends of the cells that no triangle covers: those at the nearest points of the borders.
void extrapolate(const std::vector<std::array<uint32_t, 2>>& borders, std::span<const DiscPoint> sites,
                 const ViewGrid& grid, std::vector<CellBlend>& blends,
                 const std::vector<uint8_t>& isCovered) {
  std::vector<uint32_t> cells;
  std::vector<double> x, y;
  for (uint32_t cell = 0; cell < isCovered.size(); ++cell) {
    if (isCovered[cell]) continue;
    const DiscPoint center = grid.center(cell);
    cells.push_back(cell), x.push_back(center[0]), y.push_back(center[1]);
  }
  std::vector<double> least(cells.size(), std::numeric_limits<double>::infinity()), shares(cells.size(), 0);
  std::vector<double> nearest(cells.size(), 0); // index of a border
  for (size_t b = 0; b < borders.size(); ++b) {
    const DiscPoint from = sites[borders[b][0]], edge = sites[borders[b][1]] - from;
    const double length = edge.squaredNorm();
    const DiscPoint along = length > 0 ? DiscPoint(edge / length) : DiscPoint::Zero();
    const auto index = static_cast<double>(b);
    for (size_t i = 0; i < x.size(); ++i) { // arithmetic without branches
      const double offX = x[i] - from[0], offY = y[i] - from[1];
      const double share = std::min(std::max(offX * along[0] + offY * along[1], 0.0), 1.0);
      const double restX = offX - share * edge[0], restY = offY - share * edge[1];
      const double distance = restX * restX + restY * restY;
      const bool isNearer = distance < least[i];
      least[i] = isNearer ? distance : least[i];
      shares[i] = isNearer ? share : shares[i];
      nearest[i] = isNearer ? index : nearest[i];
    }
  }
  const double reach = 1.0 / grid.size();
  for (size_t i = 0; i < cells.size(); ++i) {
    const auto& [from, to] = borders[static_cast<size_t>(nearest[i])];
    blends[cells[i]] = {{from, to, to},
                        {static_cast<float>(1 - shares[i]), static_cast<float>(shares[i]), 0.f},
                        least[i] <= reach * reach};
  }
}

} // namespace

bool SiteMesh::holdsFor(std::span<const DiscPoint> sites) const {
  return std::ranges::all_of(triangles, [&](const Triangle& corners) {
    return doubledArea(sites[corners[0]], sites[corners[1]], sites[corners[2]]) > kLeastArea;
  });
}

SiteMesh siteMesh(std::span<const DiscPoint> sites) {
  SiteMesh mesh;
  if (sites.empty()) return mesh;
  mesh.triangles = delaunayTriangles(sites);
  mesh.borders = mesh.triangles.empty() ? segmentsOf(sites) : bordersOf(mesh.triangles);
  return mesh;
}

std::vector<CellBlend> cellBlends(const SiteMesh& mesh, std::span<const DiscPoint> sites,
                                  const ViewGrid& grid) {
  if (mesh.borders.empty()) return {};
  std::vector<CellBlend> blends(grid.cells());
  std::vector<uint8_t> isCovered(grid.cells(), 0);
  for (const Triangle& corners : mesh.triangles) coverCells(corners, sites, grid, blends, isCovered);
  extrapolate(mesh.borders, sites, grid, blends, isCovered);
  return blends;
}

void pointBlends(const SiteMesh& mesh, std::span<const DiscPoint> sites, std::span<const DiscPoint> points,
                 double reach, std::span<uint32_t> places, std::span<CellBlend> blends) {
  assert(!mesh.borders.empty() && places.size() == points.size() && blends.size() == points.size());
  std::vector<std::array<Barycentric, 3>> barycentrics;
  barycentrics.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    barycentrics.push_back({Barycentric(sites[a], sites[b], sites[c]),
                            Barycentric(sites[b], sites[c], sites[a]),
                            Barycentric(sites[c], sites[a], sites[b])});
  const auto isCovered = [&](size_t i, uint32_t triangle) {
    const auto& [a, b, c] = barycentrics[triangle];
    const Vec3<double> raw(a.at(points[i]), b.at(points[i]), c.at(points[i]));
    if (!(raw.minCoeff() >= -kRounding)) return false;
    const Vec3<double> weights = raw.cwiseMax(0) / raw.cwiseMax(0).sum();
    blends[i] = {
        mesh.triangles[triangle],
        {static_cast<float>(weights[0]), static_cast<float>(weights[1]), static_cast<float>(weights[2])},
        true};
    places[i] = triangle;
    return true;
  };
  const auto isInHull = [&](size_t i) {
    if (places[i] < mesh.triangles.size() && isCovered(i, places[i])) return true;
    for (uint32_t triangle = 0; triangle < mesh.triangles.size(); ++triangle)
      if (isCovered(i, triangle)) return true;
    return false;
  };
  for (size_t i = 0; i < points.size(); ++i) {
    if (isInHull(i)) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [from, to] : mesh.borders) {
      const DiscPoint edge = sites[to] - sites[from], off = points[i] - sites[from];
      const double length = edge.squaredNorm();
      const double share = length > 0 ? std::clamp(off.dot(edge) / length, 0.0, 1.0) : 0.0;
      const double distance = (off - share * edge).squaredNorm();
      if (!(distance < least)) continue;
      least = distance;
      blends[i] = {{from, to, to},
                   {static_cast<float>(1 - share), static_cast<float>(share), 0.f},
                   distance <= reach * reach};
    }
  }
}

} // namespace surflect::lfm
