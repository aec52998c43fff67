// Exact nearest neighbours among points.
#pragma once

#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect {

class NeighborIndex {
public:
  // Copies the points. Fastest if successive points are near each other. A tree holds at most `mostInTree` >
  // 0 points, because building one cannot be interrupted and takes more than linear time. Throws Cancelled
  // between two trees.
  explicit NeighborIndex(std::span<const Point3<AcquisitionSpace>> points, const Progress& progress = {},
                         size_t mostInTree = size_t{1} << 20);
  ~NeighborIndex();

  struct Neighbor {
    uint32_t index;
    float distance; // scene units
  };
  // The k nearest, nearest first; fewer if there are fewer points. A point of the set finds itself first.
  std::vector<Neighbor> nearest(const Point3<AcquisitionSpace>& p, size_t k) const;
  // The k nearest, with weights that fall to 0 where another point comes to be among them, and sum to 1; all
  // weights are equal if there are no more than k points, or if all k + 1 are equally far.
  struct Weighted {
    uint32_t index;
    float weight;
  };
  std::vector<Weighted> blended(const Point3<AcquisitionSpace>& p, size_t k) const;
  // All points within the radius, in order of index.
  std::vector<Neighbor> within(const Point3<AcquisitionSpace>& p, float radius) const;

private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

} // namespace surflect
