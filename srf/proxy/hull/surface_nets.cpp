#include "srf/proxy/hull/surface_nets.h"

#include <tbb/parallel_for.h>

#include <array>
#include <cassert>
#include <limits>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace surflect::hull {

namespace {

constexpr int kSide = BrickGrid::kSide;
using Corner = BrickGrid::Corner;

Corner plus(const Corner& a, int x, int y, int z) { return {a[0] + x, a[1] + y, a[2] + z}; }
// Corner c of a cell: bit 0 steps along x, bit 1 along y, bit 2 along z.
Corner cornerOf(const Corner& cell, int c) { return plus(cell, c & 1, c >> 1 & 1, c >> 2 & 1); }

// Values for the cells of one brick.
class Neighborhood {
public:
  Neighborhood(const BrickGrid& grid, size_t brick) : first_(grid.firstCorner(brick)) {
    for (int z = 0; z <= kSide; ++z)
      for (int y = 0; y <= kSide; ++y)
        for (int x = 0; x <= kSide; ++x) values_[index(x, y, z)] = grid.at(plus(first_, x, y, z));
  }

  // Calls use(first corner, its eight values) for each cell that the surface crosses.
  template <class Use> void forCrossedCells(const Use& use) const {
    for (int z = 0; z < kSide; ++z)
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
          std::array<float, 8> values;
          int inside = 0;
          for (int c = 0; c < 8; ++c) {
            values[static_cast<size_t>(c)] = values_[index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))];
            inside += values[static_cast<size_t>(c)] > 0;
          }
          if (inside > 0 && inside < 8) use(plus(first_, x, y, z), values);
        }
  }

private:
  static size_t index(int x, int y, int z) {
    return static_cast<size_t>((z * (kSide + 1) + y) * (kSide + 1) + x);
  }

  Corner first_;
  std::array<float, (kSide + 1) * (kSide + 1) * (kSide + 1)> values_;
};

// Outside corner to fill where inside corners meet only across a diagonal: the one nearest to the surface.
// Empty if there is no such case.
std::optional<int> cornerToFill(const std::array<float, 8>& values) {
  const auto inside = [&](int c) { return values[static_cast<size_t>(c)] > 0; };
  std::optional<int> best;
  const auto offer = [&](int c) {
    if (!inside(c) && (!best || values[static_cast<size_t>(c)] > values[static_cast<size_t>(*best)]))
      best = c;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int a = side << axis, u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
      if (inside(a) != inside(a | u | v) || inside(a | u) != inside(a | v) || inside(a) == inside(a | u))
        continue;
      for (const int c : {a, a | u, a | v, a | u | v}) offer(c);
    }
  if (best) return best;
  for (int c = 0; c < 4; ++c) {
    int alike = 0;
    for (int other = 0; other < 8; ++other) alike += inside(other) == inside(c);
    if (inside(c) != inside(7 - c) || alike != 2) continue;
    for (int other = 0; other < 8; ++other) offer(other);
  }
  return best;
}

void makeWellComposed(BrickGrid& grid, const Progress& progress) {
  std::vector<size_t> bricks;
  for (size_t brick = 0; brick < grid.brickCount(); ++brick)
    if (grid.mayHaveSurface(brick)) bricks.push_back(brick);
  const auto filled = static_cast<float>(0.05 * grid.shape().voxel); // just inside
  while (!bricks.empty()) {
    std::vector<std::vector<Corner>> fills(bricks.size());
    tbb::parallel_for(size_t{0}, bricks.size(), [&](size_t i) {
      progress.checkpoint();
      Neighborhood(grid, bricks[i])
          .forCrossedCells([&](const Corner& cell, const std::array<float, 8>& values) {
            if (const auto corner = cornerToFill(values)) fills[i].push_back(cornerOf(cell, *corner));
          });
    });
    std::set<size_t> touched;
    for (const auto& corners : fills)
      for (const Corner& corner : corners) {
        grid.set(corner, filled);
        for (int c = 0; c < 8; ++c)
          touched.insert(grid.brickOf(plus(corner, -(c & 1), -(c >> 1 & 1), -(c >> 2))));
      }
    bricks = {touched.begin(), touched.end()};
  }
}

Vec3<double> meanCrossing(const Corner& cell, const std::array<float, 8>& values) {
  Vec3<double> sum = Vec3<double>::Zero();
  int count = 0;
  for (int c = 0; c < 8; ++c)
    for (int axis = 0; axis < 3; ++axis) {
      const int d = c | 1 << axis;
      const double a = static_cast<double>(values[static_cast<size_t>(c)]),
                   b = static_cast<double>(values[static_cast<size_t>(d)]);
      if (d == c || (a > 0) == (b > 0)) continue;
      const Corner from = cornerOf(cell, c);
      Vec3<double> p(from[0], from[1], from[2]);
      p[axis] += a / (a - b);
      sum += p;
      ++count;
    }
  return sum / count;
}

// Bricks with vertices, and the first vertex of each.
struct Net {
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  std::vector<size_t> bricks;
  std::vector<std::array<uint32_t, kSide * kSide * kSide>> vertexOf; // per brick and cell
  std::vector<uint32_t> slotOf;                                      // per brick of the grid

  static size_t indexOf(const Corner& cell) {
    return static_cast<size_t>((cell[2] % kSide * kSide + cell[1] % kSide) * kSide + cell[0] % kSide);
  }
  uint32_t vertex(const BrickGrid& grid, const Corner& cell) const {
    const uint32_t slot = slotOf[grid.brickOf(cell)];
    assert(slot != kNone);
    return vertexOf[slot][indexOf(cell)];
  }
};

double squaredLength(const TriangleMesh& mesh, uint32_t a, uint32_t b) {
  return (mesh.positions[a].raw() - mesh.positions[b].raw()).cast<double>().squaredNorm();
}

// Quad around the edge from a cell's first corner along an axis.
std::array<std::array<uint32_t, 3>, 2> quadAround(const BrickGrid& grid, const Net& net,
                                                  const TriangleMesh& mesh, const Corner& corner, int axis,
                                                  bool startsInside) {
  Corner u{}, v{};
  u[static_cast<size_t>((axis + 1) % 3)] = -1;
  v[static_cast<size_t>((axis + 2) % 3)] = -1;
  std::array<uint32_t, 4> quad{
      net.vertex(grid, corner), net.vertex(grid, plus(corner, u[0], u[1], u[2])),
      net.vertex(grid, plus(corner, u[0] + v[0], u[1] + v[1], u[2] + v[2])),
      net.vertex(grid, plus(corner, v[0], v[1], v[2]))}; // counter-clockwise, seen from the axis's tip
  if (!startsInside) std::swap(quad[1], quad[3]);
  const auto& [a, b, c, d] = quad;
  if (squaredLength(mesh, a, c) <= squaredLength(mesh, b, d)) return {{{a, b, c}, {a, c, d}}};
  return {{{b, c, d}, {b, d, a}}};
}

} // namespace

TriangleMesh surfaceNet(BrickGrid grid, const Progress& progress) {
  makeWellComposed(grid, progress);

  Net net;
  net.slotOf.assign(grid.brickCount(), Net::kNone);
  for (size_t brick = 0; brick < grid.brickCount(); ++brick)
    if (grid.mayHaveSurface(brick)) {
      net.slotOf[brick] = static_cast<uint32_t>(net.bricks.size());
      net.bricks.push_back(brick);
    }
  net.vertexOf.resize(net.bricks.size());
  std::vector<std::vector<Vec3<double>>> vertices(net.bricks.size());
  tbb::parallel_for(size_t{0}, net.bricks.size(), [&](size_t slot) {
    progress.checkpoint();
    net.vertexOf[slot].fill(Net::kNone);
    Neighborhood(grid, net.bricks[slot])
        .forCrossedCells([&](const Corner& cell, const std::array<float, 8>& values) {
          net.vertexOf[slot][Net::indexOf(cell)] = static_cast<uint32_t>(vertices[slot].size());
          vertices[slot].push_back(meanCrossing(cell, values));
        });
  });
  TriangleMesh mesh;
  for (size_t slot = 0; slot < net.bricks.size(); ++slot) {
    const auto begin = static_cast<uint32_t>(mesh.positions.size());
    for (uint32_t& vertex : net.vertexOf[slot])
      if (vertex != Net::kNone) vertex += begin;
    for (const Vec3<double>& p : vertices[slot])
      mesh.positions.push_back(
          assume<Point3<AcquisitionSpace>>(Vec3<double>(grid.shape().origin + grid.shape().voxel * p)));
  }

  std::vector<std::vector<std::array<uint32_t, 3>>> triangles(net.bricks.size());
  tbb::parallel_for(size_t{0}, net.bricks.size(), [&](size_t slot) {
    progress.checkpoint();
    Neighborhood(grid, net.bricks[slot])
        .forCrossedCells([&](const Corner& cell, const std::array<float, 8>& values) {
          for (int axis = 0; axis < 3; ++axis) {
            const bool inside = values[0] > 0;
            if (inside == (values[size_t{1} << axis] > 0)) continue;
            for (const auto& triangle : quadAround(grid, net, mesh, cell, axis, inside))
              triangles[slot].push_back(triangle);
          }
        });
  });
  for (const auto& part : triangles) mesh.triangles.insert(mesh.triangles.end(), part.begin(), part.end());
  return mesh;
}

namespace {

// Vertex neighbours. In a closed, consistently wound mesh each half-edge a -> b is in one triangle, so every
// edge is found once from each end.
struct Neighbors {
  std::vector<size_t> start;
  std::vector<uint32_t> vertices; // those of vertex i from start[i] to start[i + 1]

  explicit Neighbors(const TriangleMesh& mesh) : start(mesh.positions.size() + 1, 0) {
    for (const auto& triangle : mesh.triangles)
      for (const uint32_t corner : triangle) ++start[corner + 1];
    for (size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
    vertices.resize(start.back());
    std::vector<size_t> next(start.begin(), start.end() - 1);
    for (const auto& triangle : mesh.triangles)
      for (size_t c = 0; c < 3; ++c) vertices[next[triangle[c]]++] = triangle[(c + 1) % 3];
  }
};

} // namespace

TriangleMesh smoothed(TriangleMesh mesh, int pairs, const Progress& progress) {
  const Neighbors neighbors(mesh);
  std::vector<Point3<AcquisitionSpace>> moved(mesh.positions.size());
  for (int step = 0; step < 2 * pairs; ++step) {
    progress.checkpoint();
    const double strength = step % 2 == 0 ? 0.5 : -0.53;
    tbb::parallel_for(size_t{0}, moved.size(), [&](size_t i) {
      const Vec3<double> p = mesh.positions[i].cast<double>().raw();
      Vec3<double> offset = Vec3<double>::Zero();
      for (size_t n = neighbors.start[i]; n < neighbors.start[i + 1]; ++n)
        offset += mesh.positions[neighbors.vertices[n]].cast<double>().raw() - p;
      const auto count = static_cast<double>(neighbors.start[i + 1] - neighbors.start[i]);
      moved[i] = assume<Point3<AcquisitionSpace>>(Vec3<double>(p + strength / count * offset));
    });
    mesh.positions.swap(moved);
  }
  return mesh;
}

} // namespace surflect::hull
