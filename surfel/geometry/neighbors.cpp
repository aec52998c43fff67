#include "surfel/geometry/neighbors.h"

#include <flann/flann.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace surflect {

namespace {

// KDTreeSingleIndex is exact with unlimited checks; its distances are squared.
using Index = flann::KDTreeSingleIndex<flann::L2_Simple<float>>;

flann::SearchParams exact(bool sorted) {
  flann::SearchParams params(flann::FLANN_CHECKS_UNLIMITED, 0.f, sorted);
  params.cores = 1;
  return params;
}

// A contiguous range of the points.
struct Part {
  size_t first = 0, count = 0;
  std::unique_ptr<Index> index;
  float low[3], high[3]; // bounding box

  // Lower bound of the squared distance to the part's points, rounded step by step like FLANN's distances.
  float squaredDistance(const float* p) const {
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float off = std::max({low[axis] - p[axis], p[axis] - high[axis], 0.f});
      sum += off * off;
    }
    return sum;
  }
};

using Found = std::pair<float, uint32_t>; // squared distance, index

void collect(const Part& part, const std::vector<size_t>& indices, const std::vector<float>& squared,
             std::vector<Found>& found) {
  for (size_t i = 0; i < indices.size(); ++i)
    found.emplace_back(squared[i], static_cast<uint32_t>(part.first + indices[i]));
}

std::vector<NeighborIndex::Neighbor> neighborsOf(std::span<const Found> found) {
  std::vector<NeighborIndex::Neighbor> neighbors;
  neighbors.reserve(found.size());
  for (const auto& [squared, index] : found) neighbors.push_back({index, std::sqrt(squared)});
  return neighbors;
}

} // namespace

struct NeighborIndex::Tree {
  std::vector<float> coordinates;
  std::vector<Part> parts;
};

NeighborIndex::NeighborIndex(std::span<const Point3<AcquisitionSpace>> points, const Progress& progress,
                             size_t mostInTree) {
  auto tree = std::make_unique<Tree>();
  for (const auto& p : points) tree->coordinates.insert(tree->coordinates.end(), {p.x(), p.y(), p.z()});
  for (size_t first = 0; first < points.size(); first += mostInTree) {
    progress.checkpoint();
    Part& part = tree->parts.emplace_back();
    part.first = first;
    part.count = std::min(mostInTree, points.size() - first);
    float* const begin = tree->coordinates.data() + 3 * first;
    for (int axis = 0; axis < 3; ++axis) part.low[axis] = part.high[axis] = begin[axis];
    for (size_t i = 0; i < 3 * part.count; ++i) {
      part.low[i % 3] = std::min(part.low[i % 3], begin[i]);
      part.high[i % 3] = std::max(part.high[i % 3], begin[i]);
    }
    part.index = std::make_unique<Index>(flann::Matrix<float>(begin, part.count, 3),
                                         flann::KDTreeSingleIndexParams(12));
    part.index->buildIndex();
  }
  tree_ = std::move(tree);
}

NeighborIndex::~NeighborIndex() = default;

std::vector<NeighborIndex::Neighbor> NeighborIndex::nearest(const Point3<AcquisitionSpace>& p,
                                                            size_t k) const {
  float query[3] = {p.x(), p.y(), p.z()};
  std::vector<std::vector<size_t>> indices;
  std::vector<std::vector<float>> squared;
  std::vector<Found> found;
  for (const Part& part : tree_->parts) {
    if (k == 0 || (found.size() == k && part.squaredDistance(query) > found.back().first)) continue;
    part.index->knnSearch(flann::Matrix<float>(query, 1, 3), indices, squared, std::min(k, part.count),
                          exact(true));
    const bool isFirst = found.empty();
    collect(part, indices[0], squared[0], found);
    if (isFirst) continue; // already sorted by FLANN
    std::ranges::sort(found);
    found.resize(std::min(found.size(), k));
  }
  return neighborsOf(found);
}

std::vector<NeighborIndex::Weighted> NeighborIndex::blended(const Point3<AcquisitionSpace>& p,
                                                            size_t k) const {
  const std::vector<Neighbor> near = nearest(p, k + 1);
  const float end = near.size() > k ? near.back().distance : 0; // where the weights are 0
  std::vector<Weighted> all;
  float sum = 0;
  for (const auto& [index, distance] : near) {
    all.push_back({index, end > 0 ? std::max(0.f, 1 - distance / end) : 1});
    sum += all.back().weight;
  }
  for (Weighted& each : all) each.weight = sum > 0 ? each.weight / sum : 1 / static_cast<float>(all.size());
  return all;
}

std::vector<NeighborIndex::Neighbor> NeighborIndex::within(const Point3<AcquisitionSpace>& p,
                                                           float radius) const {
  float query[3] = {p.x(), p.y(), p.z()};
  std::vector<std::vector<size_t>> indices;
  std::vector<std::vector<float>> squared;
  std::vector<Found> found;
  for (const Part& part : tree_->parts) {
    if (part.squaredDistance(query) > radius * radius) continue;
    part.index->radiusSearch(flann::Matrix<float>(query, 1, 3), indices, squared, radius * radius,
                             exact(false));
    collect(part, indices[0], squared[0], found);
  }
  std::ranges::sort(found, {}, &Found::second);
  return neighborsOf(found);
}

} // namespace surflect
