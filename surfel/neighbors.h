// Nearest neighbours among points, exact.
#pragma once

#include "surfel/progress.h"
#include "surfel/space.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect {

class NeighborIndex {
public:
  // The points are copied. Quickest where those that follow each other are near each other. Throws Cancelled.
  explicit NeighborIndex(std::span<const Point3<AcquisitionSpace>> points, const Progress& progress = {});
  ~NeighborIndex();

  struct Neighbor {
    uint32_t index;
    float distance; // scene units
  };
  // The k nearest, nearest first; fewer where there are fewer points. A point of the set finds itself first.
  std::vector<Neighbor> nearest(const Point3<AcquisitionSpace>& p, size_t k) const;
  // All within the radius, in order of index.
  std::vector<Neighbor> within(const Point3<AcquisitionSpace>& p, float radius) const;

private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

} // namespace surflect
