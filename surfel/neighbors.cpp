#include "surfel/neighbors.h"

#include <flann/flann.hpp>

#include <algorithm>
#include <cmath>

namespace surflect {

namespace {

// KDTreeSingleIndex is exact when its checks are unlimited; its distances are squared.
using Index = flann::KDTreeSingleIndex<flann::L2_Simple<float>>;

flann::SearchParams exact(bool sorted) {
  flann::SearchParams params(flann::FLANN_CHECKS_UNLIMITED, 0.f, sorted);
  params.cores = 1;
  return params;
}

} // namespace

struct NeighborIndex::Tree {
  std::vector<float> coordinates;
  std::unique_ptr<Index> index;
};

NeighborIndex::NeighborIndex(std::span<const Point3<AcquisitionSpace>> points) {
  auto tree = std::make_unique<Tree>();
  for (const auto& p : points) tree->coordinates.insert(tree->coordinates.end(), {p.x(), p.y(), p.z()});
  if (!points.empty()) {
    const flann::Matrix<float> matrix(tree->coordinates.data(), points.size(), 3);
    tree->index = std::make_unique<Index>(matrix, flann::KDTreeSingleIndexParams(12));
    tree->index->buildIndex();
  }
  tree_ = std::move(tree);
}

NeighborIndex::~NeighborIndex() = default;

namespace {

std::vector<NeighborIndex::Neighbor> collect(const std::vector<size_t>& indices,
                                             const std::vector<float>& squared) {
  std::vector<NeighborIndex::Neighbor> neighbors;
  neighbors.reserve(indices.size());
  for (size_t i = 0; i < indices.size(); ++i)
    neighbors.push_back({static_cast<uint32_t>(indices[i]), std::sqrt(squared[i])});
  return neighbors;
}

} // namespace

std::vector<NeighborIndex::Neighbor> NeighborIndex::nearest(const Point3<AcquisitionSpace>& p,
                                                            size_t k) const {
  if (!tree_->index) return {};
  float query[3] = {p.x(), p.y(), p.z()};
  std::vector<std::vector<size_t>> indices;
  std::vector<std::vector<float>> squared;
  tree_->index->knnSearch(flann::Matrix<float>(query, 1, 3), indices, squared,
                          std::min(k, tree_->coordinates.size() / 3), exact(true));
  return collect(indices[0], squared[0]);
}

std::vector<NeighborIndex::Neighbor> NeighborIndex::within(const Point3<AcquisitionSpace>& p,
                                                           float radius) const {
  if (!tree_->index) return {};
  float query[3] = {p.x(), p.y(), p.z()};
  std::vector<std::vector<size_t>> indices;
  std::vector<std::vector<float>> squared;
  tree_->index->radiusSearch(flann::Matrix<float>(query, 1, 3), indices, squared, radius * radius,
                             exact(false));
  auto found = collect(indices[0], squared[0]);
  std::ranges::sort(found, {}, &Neighbor::index);
  return found;
}

} // namespace surflect
