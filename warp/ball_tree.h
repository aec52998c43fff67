// Search tree for the balls that contain a point.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace surflect::warp {

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

} // namespace surflect::warp
