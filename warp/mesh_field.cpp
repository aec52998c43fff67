#include "warp/mesh_field.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>

namespace surflect::warp {

namespace {

// Kernel radius in mean edge lengths around the vertex. On a torus of 24 x 10 vertices, twisted or bent by a
// radian per unit, 2 gives the smallest tangent errors (root mean square 0.030 and 0.015; normals 0.6 and 0.5
// degrees). At 1.5 single vertices show in the gradient (0.030, 0.023); at 2.5 the motion is blurred (0.040,
// 0.020).
constexpr double kernelReach = 2;
// Where the kernels of a level sum to less than `thin`, the next level joins, scaled by `joinScale` (see
// Blend). Both values keep the gradient slowly varying: around jittered tori of 12 x 6 vertices it changes by
// at most 14 per unit (37 with 0.3 and 0.02, 130 with 0.15 and 0.3).
constexpr double thin = 0.5, joinScale = 0.1;

// A weight with its gradient at a point.
struct Weight {
  double value;
  Vec3<double> gradient;
};

Weight product(const Weight& a, const Weight& b) {
  return {a.value * b.value, a.value * b.gradient + b.value * a.gradient};
}

// (1 - d/r)^4 (4 d/r + 1) within r   [Wendland 1995]
Weight kernel(const Vec3<double>& offset, double radius) {
  const double squared = offset.squaredNorm() / (radius * radius);
  if (!(squared < 1)) return {0, Vec3<double>::Zero()};
  const double q = std::sqrt(squared), p = 1 - q;
  const double p3 = p * p * p;
  return {p3 * p * (4 * q + 1), -20 * p3 / (radius * radius) * offset};
}

struct Triangle {
  std::array<uint32_t, 3> nodes;
  double area;
  Mat3<double> fromEdges; // inverse of (b - a, c - a, unit normal)
};

// Gradient of the map from the triangle at rest to its deformed corners:
//   (b' - a', c' - a', s n') (b - a, c - a, n)^-1,  s = sqrt(area' / area)
Mat3<double> gradientOf(const Triangle& triangle, std::span<const Vec3<double>> positions) {
  const Vec3<double>& a = positions[triangle.nodes[0]];
  Mat3<double> edges;
  edges.col(0) = positions[triangle.nodes[1]] - a;
  edges.col(1) = positions[triangle.nodes[2]] - a;
  const Vec3<double> across = edges.col(0).cross(edges.col(1));
  const double doubleArea = across.norm();
  edges.col(2) = doubleArea > 0 ? Vec3<double>(across / std::sqrt(doubleArea * 2 * triangle.area))
                                : Vec3<double>(Vec3<double>::Zero());
  return edges * triangle.fromEdges;
}

// One level of kernels in space: of the vertices, or of groups of the previous level.
struct Level {
  std::vector<Vec3<double>> center;
  std::vector<double> radius, mass; // mass: area around the vertex or group
  BallTree tree;
  std::vector<uint32_t> groupOf; // index in the next level; empty for the last

  size_t size() const { return center.size(); }
};

// Groups nodes of a level by the cells of a grid that begins at `least`.
Level grouped(Level& fine, const Vec3<double>& least, double side) {
  std::vector<std::pair<std::array<double, 3>, uint32_t>> order; // by cell
  for (uint32_t i = 0; i < fine.size(); ++i) {
    const Vec3<double> cell = ((fine.center[i] - least) / side).array().floor();
    order.emplace_back(std::array{cell[0], cell[1], cell[2]}, i);
  }
  std::ranges::sort(order);
  Level coarse;
  fine.groupOf.resize(fine.size());
  for (size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || order[k].first != order[k - 1].first) {
      coarse.center.emplace_back(Vec3<double>::Zero());
      coarse.radius.push_back(kernelReach * side);
      coarse.mass.push_back(0);
    }
    const uint32_t i = order[k].second;
    fine.groupOf[i] = static_cast<uint32_t>(coarse.size() - 1);
    coarse.mass.back() += fine.mass[i];
    coarse.center.back() += fine.mass[i] * fine.center[i];
    coarse.radius.back() = std::max(coarse.radius.back(), fine.radius[i]);
  }
  for (size_t g = 0; g < coarse.size(); ++g) coarse.center[g] /= coarse.mass[g];
  return coarse;
}

// Levels of the nodes and of increasing groups: each has at most half of the previous one, the last has one.
// The smallest cells are as wide as the median node's kernel.
std::vector<Level> levelsOf(Level nodes) {
  Vec3<double> least = nodes.center.front();
  for (const Vec3<double>& c : nodes.center) least = least.cwiseMin(c);
  std::vector<double> radii = nodes.radius;
  const auto median = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::ranges::nth_element(radii, median);
  double side = *median;

  std::vector<Level> levels;
  levels.push_back(std::move(nodes));
  while (levels.back().size() > 1) {
    Level& fine = levels.back();
    Level coarse;
    do {
      coarse = grouped(fine, least, side);
      side *= 2;
    } while (coarse.size() > fine.size() / 2);
    levels.push_back(std::move(coarse));
  }
  for (Level& level : levels) level.tree = BallTree(level.center, level.radius);
  return levels;
}

} // namespace

// Vertices of the rest mesh that are corners of a triangle, merged by position.
struct MeshField::Binding {
  std::vector<uint32_t> nodeOf; // per given vertex; or none
  std::vector<Triangle> triangles;
  std::vector<Level> levels; // the first level holds the nodes

  static constexpr uint32_t none = UINT32_MAX;
};

namespace {

// The affine map of a node: x -> position + gradient (x - rest).
struct NodeMap {
  Vec3<double> rest;
  double radius;
  Vec3<double> position;
  Mat3<double> gradient;

  Vec3<double> operator()(const Vec3<double>& x) const { return position + gradient * (x - rest); }
};

// Mean map of each group.
std::vector<NodeMap> meansOf(const std::vector<NodeMap>& maps, const Level& fine, const Level& coarse) {
  std::vector<NodeMap> means;
  for (size_t g = 0; g < coarse.size(); ++g)
    means.push_back(
        {coarse.center[g], coarse.radius[g], Vec3<double>::Zero(), Mat3<double>(Mat3<double>::Zero())});
  for (size_t i = 0; i < maps.size(); ++i) {
    const uint32_t g = fine.groupOf[i];
    const double share = fine.mass[i] / coarse.mass[g];
    means[g].position += share * maps[i](coarse.center[g]);
    means[g].gradient += share * maps[i].gradient;
  }
  return means;
}

// Weighted sums over the nodes, with weights w and maps T.
struct Sums {
  double weight = 0; // sum of w
  Vec3<double> weightGradient = Vec3<double>::Zero();
  Vec3<double> mapped = Vec3<double>::Zero();         // sum of w T(x)
  Mat3<double> mappedGradient = Mat3<double>::Zero(); // of the sum of w T(x)
};

// Factor of the next level's kernels, from the sum m of this level's:
//   e(m) = joinScale (1 - m / thin)^2 below `thin`
Weight joining(const Weight& sum) {
  const double lack = std::max(0., 1 - sum.value / thin);
  return {joinScale * lack * lack, -2 * joinScale * lack / thin * sum.gradient};
}

//   Psi = S / W with S = sum of w_i T_i(x), W = sum of w_i
//   J   = (dS - Psi dW^T) / W
// over the nodes of all levels. With phi the kernels and m their sum on a level, kernels of level l have the
// weight
//   w_i = phi_i e(m_0) e(m_1) ... e(m_(l-1))
// and beyond the last level the mean of all has that product, so that W is never 0.
class Blend final : public Warp {
public:
  Blend(std::shared_ptr<const std::vector<Level>> levels, std::vector<std::vector<NodeMap>> maps)
      : levels_(std::move(levels)), maps_(std::move(maps)) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    const Sums sums = sumsAt<false>(x);
    return sums.mapped / sums.weight;
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    const Sums sums = sumsAt<true>(x);
    const Vec3<double> psi = sums.mapped / sums.weight;
    return (sums.mappedGradient - psi * sums.weightGradient.transpose()) / sums.weight;
  }

private:
  template <bool gradients>
  static void add(const NodeMap& map, const Vec3<double>& x, const Weight& weight, Sums& sums) {
    const Vec3<double> mapped = map(x);
    sums.weight += weight.value;
    sums.mapped += weight.value * mapped;
    if constexpr (gradients) {
      sums.weightGradient += weight.gradient;
      sums.mappedGradient += weight.value * map.gradient + mapped * weight.gradient.transpose();
    }
  }

  template <bool gradients> Sums sumsAt(const Vec3<double>& x) const {
    Sums sums;
    Weight share{1, Vec3<double>::Zero()};
    for (size_t l = 0; l < maps_.size(); ++l) {
      Weight sum{0, Vec3<double>::Zero()};
      (*levels_)[l].tree.forEachNear(x, [&](uint32_t i) {
        const NodeMap& map = maps_[l][i];
        const Weight phi = kernel(x - map.rest, map.radius);
        if (!(phi.value > 0)) return;
        sum = {sum.value + phi.value, sum.gradient + phi.gradient};
        add<gradients>(map, x, product(share, phi), sums);
      });
      if (sum.value >= thin) return sums;
      share = product(share, joining(sum));
    }
    add<gradients>(maps_.back().front(), x, share, sums);
    return sums;
  }

  std::shared_ptr<const std::vector<Level>> levels_;
  std::vector<std::vector<NodeMap>> maps_; // per level
};

// First vertex at the same position, per vertex.
std::vector<uint32_t> firstAtSamePlace(std::span<const Vec3<double>> positions) {
  std::vector<uint32_t> order(positions.size()), first(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](uint32_t i) {
    return std::tuple(positions[i][0], positions[i][1], positions[i][2], i);
  };
  std::ranges::sort(order, {}, key);
  for (size_t k = 0; k < order.size(); ++k)
    first[order[k]] =
        k > 0 && positions[order[k]] == positions[order[k - 1]] ? first[order[k - 1]] : order[k];
  return first;
}

} // namespace

MeshField::MeshField(std::span<const Vec3<double>> positions,
                     std::span<const std::array<uint32_t, 3>> triangles) {
  auto binding = std::make_shared<Binding>();
  const std::vector<uint32_t> first = firstAtSamePlace(positions);

  Level nodes;
  std::vector<uint32_t> nodeOfFirst(positions.size(), Binding::none);
  for (const auto& corners : triangles) {
    const Vec3<double>&a = positions[corners[0]], &b = positions[corners[1]], &c = positions[corners[2]];
    const Vec3<double> across = (b - a).cross(c - a);
    const double doubleArea = across.norm();
    // Slivers thinner than rounding have no normal.
    if (!(doubleArea > 1e-12 * std::max((b - a).squaredNorm(), (c - a).squaredNorm()))) continue;
    Triangle triangle;
    triangle.area = doubleArea / 2;
    Mat3<double> edges;
    edges << b - a, c - a, across / doubleArea;
    triangle.fromEdges = edges.inverse();
    for (size_t i = 0; i < 3; ++i) {
      uint32_t& node = nodeOfFirst[first[corners[i]]];
      if (node == Binding::none) {
        node = static_cast<uint32_t>(nodes.size());
        nodes.center.push_back(positions[corners[i]]);
        nodes.mass.push_back(0);
      }
      nodes.mass[node] += triangle.area;
      triangle.nodes[i] = node;
    }
    binding->triangles.push_back(triangle);
  }
  if (binding->triangles.empty()) throw Error::mismatch("triangles", "none that has an area");
  for (const uint32_t vertex : first) binding->nodeOf.push_back(nodeOfFirst[vertex]);

  std::vector<double> lengths(nodes.size()), counts(nodes.size());
  for (const Triangle& triangle : binding->triangles)
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = triangle.nodes[i], b = triangle.nodes[(i + 1) % 3];
      for (const uint32_t node : {a, b}) {
        lengths[node] += (nodes.center[a] - nodes.center[b]).norm();
        counts[node] += 1;
      }
    }
  for (size_t i = 0; i < lengths.size(); ++i) nodes.radius.push_back(kernelReach * lengths[i] / counts[i]);
  binding->levels = levelsOf(std::move(nodes));
  binding_ = std::move(binding);
}

Eigen::AlignedBox3d MeshField::restBox() const {
  Eigen::AlignedBox3d box;
  for (const Vec3<double>& center : binding_->levels.front().center) box.extend(center);
  return box;
}

bool MeshField::reaches(const Vec3<double>& x) const {
  const Level& nodes = binding_->levels.front();
  bool reached = false;
  nodes.tree.forEachNear(
      x, [&](uint32_t i) { reached = reached || kernel(x - nodes.center[i], nodes.radius[i]).value > 0; });
  return reached;
}

size_t MeshField::kernelsAt(const Vec3<double>& x) const {
  size_t kernels = 0;
  for (const Level& level : binding_->levels) {
    double sum = 0;
    level.tree.forEachNear(x, [&](uint32_t i) {
      ++kernels;
      sum += kernel(x - level.center[i], level.radius[i]).value;
    });
    if (sum >= thin) break;
  }
  return kernels;
}

WarpPointer MeshField::follow(std::span<const Vec3<double>> positions) const {
  const Binding& b = *binding_;
  assert(positions.size() == b.nodeOf.size());
  const Level& nodes = b.levels.front();

  // A node's position is the mean of its vertices.
  std::vector<Vec3<double>> moved(nodes.size(), Vec3<double>::Zero());
  std::vector<double> members(nodes.size());
  for (size_t i = 0; i < positions.size(); ++i)
    if (b.nodeOf[i] != Binding::none) {
      moved[b.nodeOf[i]] += positions[i];
      members[b.nodeOf[i]] += 1;
    }
  for (size_t i = 0; i < nodes.size(); ++i) moved[i] /= members[i];

  std::vector<Mat3<double>> gradients(nodes.size(), Mat3<double>::Zero());
  for (const Triangle& triangle : b.triangles) {
    const Mat3<double> gradient = gradientOf(triangle, moved);
    for (const uint32_t node : triangle.nodes) gradients[node] += triangle.area / nodes.mass[node] * gradient;
  }
  std::vector<std::vector<NodeMap>> maps(1);
  for (size_t i = 0; i < nodes.size(); ++i)
    maps[0].push_back({nodes.center[i], nodes.radius[i], moved[i], gradients[i]});
  for (size_t l = 1; l < b.levels.size(); ++l)
    maps.push_back(meansOf(maps.back(), b.levels[l - 1], b.levels[l]));
  return std::make_unique<Blend>(std::shared_ptr<const std::vector<Level>>(binding_, &b.levels),
                                 std::move(maps));
}

} // namespace surflect::warp
