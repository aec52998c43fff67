#include "render/lightfield/slf/region_smoothing.h"

#include "render/lightfield/slf/cone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {

namespace {

constexpr double kBorderWeight = 0.15; // w
constexpr int kMostSweeps = 50;

// Triangles around each place.
class Stars {
public:
  explicit Stars(const TriangleGraph& graph)
      : first_(graph.isPinched.size() + 1, 0), triangles_(3 * graph.corners.size()) {
    for (const auto& corners : graph.corners)
      for (const uint32_t place : corners) ++first_[place + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t t = 0; t < graph.corners.size(); ++t)
      for (const uint32_t place : graph.corners[t]) triangles_[next[place]++] = t;
  }
  std::span<const uint32_t> at(uint32_t place) const {
    return std::span(triangles_).subspan(first_[place], first_[place + 1] - first_[place]);
  }

private:
  std::vector<uint32_t> first_, triangles_;
};

class Smoothing {
public:
  Smoothing(const TriangleMesh& mesh, const TriangleGraph& graph, std::span<const RegionMoments> moments,
            const RegionOptions& options, Regions& regions)
      : mesh_(mesh), graph_(graph), moments_(moments), of_(regions.ofTriangle), stars_(graph),
        regionMoments_(regions.count), leastCosine_(std::cos(options.widestCone.radians())) {
    RegionMoments all;
    for (size_t t = 0; t < of_.size(); ++t)
      regionMoments_[of_[t]] = regionMoments_[of_[t]] + moments[t], all = all + moments[t];
    squaredLength_ = all.area / static_cast<double>(regions.count);
    for (const std::vector<uint32_t>& triangles : regions.triangles())
      axes_.push_back(normalCone(mesh, triangles).axis);
  }

  // Returns the number of triangles that moved.
  size_t sweep(const Progress& progress) {
    size_t moves = 0;
    for (uint32_t t = 0; t < of_.size(); ++t) {
      progress.checkNowAndThen(t);
      double best = -1e-9 * squaredLength_;
      uint32_t to = of_[t];
      for (const uint32_t neighbor : graph_.neighbors[t]) {
        if (neighbor == kNoTriangle || of_[neighbor] == of_[t] || of_[neighbor] == to) continue;
        if (const double change = changeOf(t, of_[neighbor]); change < best && mayMove(t, of_[neighbor]))
          best = change, to = of_[neighbor];
      }
      if (to == of_[t]) continue;
      regionMoments_[of_[t]] = regionMoments_[of_[t]] - moments_[t];
      regionMoments_[to] = regionMoments_[to] + moments_[t];
      of_[t] = to;
      ++moves;
    }
    return moves;
  }

private:
  double edgeLength(uint32_t t, size_t k) const {
    const auto& corners = mesh_.triangles[t];
    return (mesh_.positions[corners[(k + 1) % 3]].cast<double>().raw() -
            mesh_.positions[corners[k]].cast<double>().raw())
        .norm();
  }

  // Change of the energy if a triangle moves.
  double changeOf(uint32_t t, uint32_t to) const {
    const double energy = unionCost(regionMoments_[to], moments_[t], squaredLength_) -
                          unionCost(regionMoments_[of_[t]] - moments_[t], moments_[t], squaredLength_);
    double border = 0;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t neighbor = graph_.neighbors[t][k];
      if (neighbor == kNoTriangle) continue;
      if (of_[neighbor] == of_[t]) border += edgeLength(t, k);
      if (of_[neighbor] == to) border -= edgeLength(t, k);
    }
    return energy + kBorderWeight * std::sqrt(squaredLength_) * border;
  }

  // Number of neighbours of a triangle in a region.
  size_t sharedEdges(uint32_t t, uint32_t region) const {
    return static_cast<size_t>(std::ranges::count_if(graph_.neighbors[t], [&](uint32_t neighbor) {
      return neighbor != kNoTriangle && of_[neighbor] == region;
    }));
  }
  // Place between the two edges that a triangle shares with a region, or opposite to the only one.
  uint32_t middle(uint32_t t, uint32_t region, size_t shared) const {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t neighbor = graph_.neighbors[t][k];
      if ((neighbor != kNoTriangle && of_[neighbor] == region) == (shared == 1))
        return graph_.corners[t][(k + 2) % 3];
    }
    return 0;
  }
  // Do all triangles around a place belong to a region, in a closed fan?
  bool isInside(uint32_t place, uint32_t region) const {
    if (graph_.isPinched[place]) return false;
    return std::ranges::all_of(stars_.at(place), [&](uint32_t t) {
      if (of_[t] != region) return false;
      for (size_t k = 0; k < 3; ++k)
        if (graph_.neighbors[t][k] == kNoTriangle &&
            (graph_.corners[t][k] == place || graph_.corners[t][(k + 1) % 3] == place))
          return false;
      return true;
    });
  }

  // Do both regions stay discs, within the cone?
  bool mayMove(uint32_t t, uint32_t to) const {
    const Vec3<double>& normal = moments_[t].normal;
    if (normal.dot(axes_[to]) < leastCosine_ * moments_[t].area) return false;
    // The triangle and the rest of its region must meet in a path of edges that holds all their common
    // places.
    const size_t own = sharedEdges(t, of_[t]), theirs = sharedEdges(t, to);
    if (own == 0 || own == 3 || theirs == 3) return false;
    if (own == 2 && !isInside(middle(t, of_[t], 2), of_[t])) return false;
    const uint32_t place = middle(t, to, theirs);
    if (theirs == 2) return !graph_.isPinched[place];
    return std::ranges::none_of(stars_.at(place), [&](uint32_t other) { return of_[other] == to; });
  }

  const TriangleMesh& mesh_;
  const TriangleGraph& graph_;
  std::span<const RegionMoments> moments_;
  std::vector<uint32_t>& of_;
  Stars stars_;
  std::vector<RegionMoments> regionMoments_;
  std::vector<Vec3<double>> axes_; // of regions' cones
  double squaredLength_ = 0, leastCosine_;
};

} // namespace

void smoothRegions(const TriangleMesh& mesh, const TriangleGraph& graph,
                   std::span<const RegionMoments> triangleMoments, const RegionOptions& options,
                   Regions& regions, const Progress& progress) {
  Smoothing smoothing(mesh, graph, triangleMoments, options, regions);
  for (int sweep = 0; sweep < kMostSweeps && smoothing.sweep(progress) > 0; ++sweep) {
  }
}

} // namespace surflect::slf
