#include "warp/mesh_field.h"

#include "surfel/error.h"
#include "warp/ball_tree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>

namespace surflect {

namespace {

// Of a kernel, in mean edge lengths around its vertex. On a torus of 24 x 10 vertices, twisted or bent by a
// radian a unit, 2 brings the tangents nearest to the truth (root mean square 0.030 and 0.015, normals 0.6
// and 0.5 degrees); at 1.5 the single vertices show in the field's gradient (0.030, 0.023), at 2.5 the motion
// is blurred (0.040, 0.020).
constexpr double kernelReach = 2;
// Where the kernels sum to less than this, vertices near enough are few, and the tails of all join, each
// times its scale: see Blend. Both are chosen so that the gradient changes slowly on the way: around a torus
// of 12 x 6 vertices, jittered, at most by 12 a unit (and by 1,900 with 0.1 and 1).
constexpr double thin = 0.3, tailScale = 0.02;

// A weight and its gradient at a point.
struct Weight {
  double value;
  Vec3<double> gradient;
};

// (1 - d/r)^4 (4 d/r + 1) within r   [Wendland 1995]
Weight kernel(const Vec3<double>& offset, double radius) {
  const double squared = offset.squaredNorm() / (radius * radius);
  if (!(squared < 1)) return {0, Vec3<double>::Zero()};
  const double q = std::sqrt(squared), p = 1 - q;
  const double p3 = p * p * p;
  return {p3 * p * (4 * q + 1), -20 * p3 / (radius * radius) * offset};
}

// tailScale (1 + d^2 / r^2)^-3
Weight tail(const Vec3<double>& offset, double radius) {
  const double s = 1 / (1 + offset.squaredNorm() / (radius * radius)), s3 = tailScale * s * s * s;
  return {s3, -6 * s3 * s / (radius * radius) * offset};
}

struct Triangle {
  std::array<uint32_t, 3> nodes;
  double area;
  Mat3<double> fromEdges; // inverse of (b - a, c - a, unit normal)
};

// The gradient of the map that takes the triangle at rest to where its corners are now:
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

} // namespace

// The vertices of the rest mesh, those at one place taken together, that are corners of a triangle.
struct MeshField::Binding {
  std::vector<uint32_t> nodeOf; // of every vertex as given; none
  std::vector<Vec3<double>> rest;
  std::vector<double> radius; // of the kernel
  std::vector<Triangle> triangles;
  BallTree tree;

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

// Sums over the nodes, of weights w and maps T.
struct Sums {
  double weight = 0; // sum of w
  Vec3<double> weightGradient = Vec3<double>::Zero();
  Vec3<double> mapped = Vec3<double>::Zero();         // sum of w T(x)
  Mat3<double> mappedGradient = Mat3<double>::Zero(); // of the sum of w T(x)
};

//   Psi = S / W with S = sum of w_i T_i(x), W = sum of w_i
//   J   = (dS - Psi dW^T) / W
// The weights are the kernels phi. Where their sum m is below `thin`, a share of the tails tau joins:
//   w_i = phi_i + e(m) tau_i,  e(m) = (1 - m / thin)^2
class Blend final : public Warp {
public:
  Blend(std::shared_ptr<const BallTree> tree, std::vector<NodeMap> maps)
      : tree_(std::move(tree)), maps_(std::move(maps)) {}

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
    tree_->forEachNear(x, [&](uint32_t i) {
      const Weight weight = kernel(x - maps_[i].rest, maps_[i].radius);
      if (weight.value > 0) add<gradients>(maps_[i], x, weight, sums);
    });
    if (sums.weight >= thin) return sums;

    const double lack = 1 - sums.weight / thin, share = lack * lack;
    const Vec3<double> shareGradient = -2 * lack / thin * sums.weightGradient;
    for (const NodeMap& map : maps_) {
      const Weight t = tail(x - map.rest, map.radius);
      add<gradients>(map, x, {share * t.value, share * t.gradient + t.value * shareGradient}, sums);
    }
    return sums;
  }

  std::shared_ptr<const BallTree> tree_;
  std::vector<NodeMap> maps_;
};

// For each vertex the first one at the same place.
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

  std::vector<uint32_t> nodeOfFirst(positions.size(), Binding::none);
  for (const auto& corners : triangles) {
    const Vec3<double>&a = positions[corners[0]], &b = positions[corners[1]], &c = positions[corners[2]];
    const Vec3<double> across = (b - a).cross(c - a);
    const double doubleArea = across.norm();
    // Slivers flatter than rounding have no normal.
    if (!(doubleArea > 1e-12 * std::max((b - a).squaredNorm(), (c - a).squaredNorm()))) continue;
    Triangle triangle;
    triangle.area = doubleArea / 2;
    Mat3<double> edges;
    edges << b - a, c - a, across / doubleArea;
    triangle.fromEdges = edges.inverse();
    for (size_t i = 0; i < 3; ++i) {
      uint32_t& node = nodeOfFirst[first[corners[i]]];
      if (node == Binding::none) {
        node = static_cast<uint32_t>(binding->rest.size());
        binding->rest.push_back(positions[corners[i]]);
      }
      triangle.nodes[i] = node;
    }
    binding->triangles.push_back(triangle);
  }
  if (binding->triangles.empty()) throw Error::mismatch("triangles", "none that has an area");
  for (const uint32_t vertex : first) binding->nodeOf.push_back(nodeOfFirst[vertex]);

  std::vector<double> lengths(binding->rest.size()), counts(binding->rest.size());
  for (const Triangle& triangle : binding->triangles)
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = triangle.nodes[i], b = triangle.nodes[(i + 1) % 3];
      for (const uint32_t node : {a, b}) {
        lengths[node] += (binding->rest[a] - binding->rest[b]).norm();
        counts[node] += 1;
      }
    }
  for (size_t i = 0; i < lengths.size(); ++i) binding->radius.push_back(kernelReach * lengths[i] / counts[i]);
  binding->tree = BallTree(binding->rest, binding->radius);
  binding_ = std::move(binding);
}

size_t MeshField::vertexCount() const { return binding_->nodeOf.size(); }

WarpPointer MeshField::follow(std::span<const Vec3<double>> positions) const {
  const Binding& b = *binding_;
  assert(positions.size() == b.nodeOf.size());
  const size_t nodes = b.rest.size();

  // A node is where its vertices are on average.
  std::vector<Vec3<double>> moved(nodes, Vec3<double>::Zero());
  std::vector<double> members(nodes);
  for (size_t i = 0; i < positions.size(); ++i)
    if (b.nodeOf[i] != Binding::none) {
      moved[b.nodeOf[i]] += positions[i];
      members[b.nodeOf[i]] += 1;
    }
  for (size_t i = 0; i < nodes; ++i) moved[i] /= members[i];

  std::vector<Mat3<double>> gradients(nodes, Mat3<double>::Zero());
  std::vector<double> areas(nodes);
  for (const Triangle& triangle : b.triangles) {
    const Mat3<double> gradient = gradientOf(triangle, moved);
    for (const uint32_t node : triangle.nodes) {
      gradients[node] += triangle.area * gradient;
      areas[node] += triangle.area;
    }
  }
  std::vector<NodeMap> maps;
  for (size_t i = 0; i < nodes; ++i)
    maps.push_back({b.rest[i], b.radius[i], moved[i], gradients[i] / areas[i]});
  return std::make_unique<Blend>(std::shared_ptr<const BallTree>(binding_, &b.tree), std::move(maps));
}

} // namespace surflect
