// Warp by a mesh: space near the mesh follows its vertices smoothly.
//
// [Sumner et al. 2007] Embedded Deformation for Shape Manipulation, SIGGRAPH 2007. [Sumner and Popovic 2004]
// Deformation Transfer for Triangle Meshes, SIGGRAPH 2004. [Wendland 1995] Piecewise polynomial, positive
// definite and compactly supported radial functions.
#pragma once

#include "surfel/math/space.h"
#include "warp/warp.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <vector>

namespace surflect::warp {

// Search tree for the balls that contain a point.

// Tree of boxes around balls. The visited balls and their order depend only on the balls and the point.
class BallTree {
public:
  BallTree() = default;
  BallTree(std::span<const Vec3<double>> centers, std::span<const double> radii) : order_(centers.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!order_.empty()) build(centers, radii, 0, order_.size());
  }

  // Calls visit(index) for every ball that contains x, and for some that do not.
  template <class Visit> void forEachNear(const Vec3<double>& x, Visit visit) const {
    for (size_t n = 0; n < nodes_.size();) {
      const Node& node = nodes_[n];
      const bool outside = (x.array() < node.least.array()).any() || (x.array() > node.most.array()).any();
      if (outside) {
        n = node.next;
        continue;
      }
      for (uint32_t i = node.begin; i < node.end; ++i) visit(order_[i]);
      ++n;
    }
  }

private:
  // Nodes in depth-first order: children follow their parent, and `next` is past the last of them.
  struct Node {
    Vec3<double> least, most;
    uint32_t begin, end; // balls of a leaf
    uint32_t next;
  };
  static constexpr size_t leafSize = 8;

  void build(std::span<const Vec3<double>> centers, std::span<const double> radii, size_t begin, size_t end) {
    Vec3<double> least = centers[order_[begin]], most = least, least0 = least, most0 = least;
    for (size_t i = begin; i < end; ++i) {
      const Vec3<double>& c = centers[order_[i]];
      const Vec3<double> radius = Vec3<double>::Constant(radii[order_[i]]);
      least0 = least0.cwiseMin(c);
      most0 = most0.cwiseMax(c);
      least = least.cwiseMin(c - radius);
      most = most.cwiseMax(c + radius);
    }
    const size_t node = nodes_.size();
    nodes_.push_back({least, most, static_cast<uint32_t>(begin), static_cast<uint32_t>(begin), 0});
    if (end - begin <= leafSize) {
      nodes_[node].end = static_cast<uint32_t>(end);
    } else {
      int axis = 0;
      (most0 - least0).maxCoeff(&axis);
      const size_t middle = (begin + end) / 2;
      const auto along = [&](uint32_t a, uint32_t b) {
        return std::pair(centers[a][axis], a) < std::pair(centers[b][axis], b);
      };
      std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, along);
      build(centers, radii, begin, middle);
      build(centers, radii, middle, end);
    }
    nodes_[node].next = static_cast<uint32_t>(nodes_.size());
  }

  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

// A mesh at rest, bound to the space around it. Each vertex carries an affine map that moves it to its
// deformed position, and rotates and stretches like the triangles around it (Deformation Transfer's gradient,
// whose normal is scaled by the root of the triangle's area). Space is moved by the blend of these maps under
// kernels around the rest vertices:
//   Psi(x) = sum of w_i(x) (q_i + G_i (x - v_i)) / sum of w_i(x)
// This is Embedded Deformation with kernels that are fixed in space and twice continuously differentiable;
// the original uses the nearest nodes, a set that changes abruptly. The mesh may be open, closed, coarse or
// in parts. It must be near the driven surface, within about the length of its edges. Further away the
// vertices fade into groups, each with the mean map of its members, and these into larger groups. Beyond the
// largest groups, space follows the mean of all maps.
//
// A mesh at rest moves nothing; a rigid motion or even scaling of the mesh moves all space in that way. A
// vertex reaches its deformed position only up to second order of the edge length: the field is smoother than
// the mesh. Parts of the mesh that lie near each other affect each other's surroundings.
class MeshField {
public:
  // Vertices at one position are merged; triangles without area are ignored. Throws Error if none is left.
  MeshField(std::span<const Vec3<double>> rest, std::span<const std::array<uint32_t, 3>> triangles);

  Eigen::AlignedBox3d restBox() const; // of the rest mesh
  // Returns whether the point is within the kernel of a vertex, not only of groups: within about twice the
  // length of the edges around it. The driven surface should be within reach.
  bool reaches(const Vec3<double>& x) const;
  // Number of kernels evaluated for the point: a few tens near the mesh, and as many for each size of groups,
  // for any number of vertices.
  size_t kernelsAt(const Vec3<double>& x) const;
  // Warp that moves each vertex of the rest mesh to the given position. Cost: kernelsAt the point.
  WarpPointer follow(std::span<const Vec3<double>> positions) const;

private:
  struct Binding;
  std::shared_ptr<const Binding> binding_;
};

} // namespace surflect::warp
