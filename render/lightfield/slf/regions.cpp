#include "render/lightfield/slf/regions.h"

#include "render/lightfield/slf/blackout_cone.h"
#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

namespace surflect::slf {

namespace {

// Moments of each triangle about a point near the mesh, its first position.
std::vector<RegionMoments> triangleMoments(const TriangleMesh& mesh) {
  std::vector<RegionMoments> moments(mesh.triangles.size());
  const Vec3<double> origin = mesh.positions.at(0).cast<double>().raw();
  for (size_t t = 0; t < moments.size(); ++t) {
    Vec3<double> sum = Vec3<double>::Zero();
    for (const uint32_t v : mesh.triangles[t]) sum += mesh.positions[v].cast<double>().raw() - origin;
    const Vec3<double> normal = areaVector(mesh, t) / 2;
    moments[t] = {normal.norm(), normal.norm() * sum / 3, normal};
  }
  return moments;
}

// Parts below this share of the mean region's area may join regardless of their normals.
constexpr double kTinyShare = 0.01;

struct Neighbor {
  uint32_t cluster;
  uint32_t edges; // shared
};

struct Cluster {
  uint32_t lastTriangle = 0; // of its chain, which starts at the triangle with the cluster's index
  RegionMoments moments;
  Cone cone;
  std::vector<uint32_t> loop;      // places of the border, counter-clockwise
  std::vector<Neighbor> neighbors; // by rising cluster
  uint32_t version = 0;            // rises with each change
};

struct Candidate {
  double cost;
  uint32_t a, b; // clusters, a < b
  uint32_t versionA, versionB;

  // For a queue whose top is the least.
  friend bool operator<(const Candidate& x, const Candidate& y) {
    return std::tie(x.cost, x.a, x.b) > std::tie(y.cost, y.a, y.b);
  }
};

void addNeighbor(std::vector<Neighbor>& neighbors, uint32_t cluster, uint32_t edges) {
  const auto at = std::ranges::lower_bound(neighbors, cluster, {}, &Neighbor::cluster);
  if (at != neighbors.end() && at->cluster == cluster)
    at->edges += edges;
  else
    neighbors.insert(at, {cluster, edges});
}

uint32_t takeNeighbor(std::vector<Neighbor>& neighbors, uint32_t cluster) {
  const auto at = std::ranges::lower_bound(neighbors, cluster, {}, &Neighbor::cluster);
  const uint32_t edges = at->edges;
  neighbors.erase(at);
  return edges;
}

class Merging {
public:
  Merging(const TriangleMesh& mesh, const TriangleGraph& graph, const RegionOptions& options)
      : mesh_(mesh), graph_(graph), options_(options), clusters_(graph.corners.size()),
        parents_(graph.corners.size()), next_(graph.corners.size(), kNoTriangle),
        order_(graph.isPinched.size(), 0) {
    std::iota(parents_.begin(), parents_.end(), 0u);
    const std::vector<RegionMoments> moments = triangleMoments(mesh);
    double area = 0;
    for (const RegionMoments& triangle : moments) area += triangle.area;
    meanArea_ = area / static_cast<double>(std::max<size_t>(1, options.regions));
    for (uint32_t t = 0; t < clusters_.size(); ++t) {
      Cluster& cluster = clusters_[t];
      cluster.lastTriangle = t;
      cluster.moments = moments[t];
      cluster.cone.axis = areaVector(mesh, t).stableNormalized();
      cluster.loop.assign(graph.corners[t].begin(), graph.corners[t].end());
      for (const uint32_t neighbor : graph.neighbors[t])
        if (neighbor != kNoTriangle) addNeighbor(cluster.neighbors, neighbor, 1);
    }
    std::vector<Candidate> candidates;
    for (uint32_t a = 0; a < clusters_.size(); ++a)
      for (const Neighbor& neighbor : clusters_[a].neighbors)
        if (a < neighbor.cluster) candidates.push_back(candidateOf(a, neighbor.cluster));
    queue_ = std::priority_queue<Candidate>(std::less<Candidate>(), std::move(candidates));
  }

  void run(const Progress& progress) {
    const size_t all = clusters_.size();
    size_t left = all;
    for (size_t step = 0; left > options_.regions && !queue_.empty(); ++step) {
      if (step % 4096 == 0)
        progress("texture regions", static_cast<double>(all - left) / static_cast<double>(all));
      const Candidate candidate = queue_.top();
      queue_.pop();
      if (candidate.versionA == clusters_[candidate.a].version &&
          candidate.versionB == clusters_[candidate.b].version)
        left -= merge(candidate.a, candidate.b);
    }
  }

  std::vector<uint32_t> labels() {
    std::vector<uint32_t> result(parents_.size());
    for (uint32_t t = 0; t < result.size(); ++t) result[t] = rootOf(parents_, t);
    return result;
  }

private:
  Candidate candidateOf(uint32_t a, uint32_t b) const {
    if (a > b) std::swap(a, b);
    return {unionCost(clusters_[a].moments, clusters_[b].moments, meanArea_), a, b, clusters_[a].version,
            clusters_[b].version};
  }

  // Cone of the union of two clusters; wider than the limit if they may not join.
  Cone coneOfBoth(uint32_t a, uint32_t b) const {
    const auto isTooWide = [&](const Cone& cone) {
      return cone.halfAngle.radians() > options_.widestCone.radians();
    };
    Cone cone = coneAround(clusters_[a].cone, clusters_[b].cone);
    if (!isTooWide(cone)) return cone;
    const uint32_t smaller = clusters_[a].moments.area < clusters_[b].moments.area ? a : b;
    if (clusters_[smaller].moments.area <= kTinyShare * meanArea_)
      return clusters_[smaller == a ? b : a].cone;
    // Cones around cones grow wider than need be.
    std::vector<uint32_t> triangles;
    for (const uint32_t cluster : {a, b})
      for (uint32_t t = cluster; t != kNoTriangle; t = next_[t]) triangles.push_back(t);
    return normalCone(mesh_, triangles);
  }

  // Joins b to a, if that is a disc within the cone. Returns whether it did.
  bool merge(uint32_t a, uint32_t b) {
    Cluster &into = clusters_[a], &from = clusters_[b];
    const auto shared = std::ranges::lower_bound(into.neighbors, b, {}, &Neighbor::cluster);
    std::vector<uint32_t> loop = unitedLoop(into.loop, from.loop, shared->edges, graph_.isPinched, order_);
    if (loop.empty()) return false;
    const Cone cone = coneOfBoth(a, b);
    if (cone.halfAngle.radians() > options_.widestCone.radians()) return false;

    next_[into.lastTriangle] = b;
    into.lastTriangle = from.lastTriangle;
    into.loop = std::move(loop);
    into.cone = cone;
    into.moments = into.moments + from.moments;
    into.neighbors.erase(shared);
    for (const Neighbor& neighbor : from.neighbors) {
      if (neighbor.cluster == a) continue;
      addNeighbor(into.neighbors, neighbor.cluster, neighbor.edges);
      std::vector<Neighbor>& theirs = clusters_[neighbor.cluster].neighbors;
      addNeighbor(theirs, a, takeNeighbor(theirs, b));
    }
    into.version += 2;
    from.loop = {}, from.neighbors = {}, ++from.version;
    parents_[b] = a;
    for (const Neighbor& neighbor : into.neighbors) queue_.push(candidateOf(a, neighbor.cluster));
    return true;
  }

  const TriangleMesh& mesh_;
  const TriangleGraph& graph_;
  const RegionOptions& options_;
  std::vector<Cluster> clusters_; // by their first triangle
  std::vector<uint32_t> parents_; // #triangles; cluster that each was joined to
  std::vector<uint32_t> next_;    // #triangles; chains of the triangles of each cluster
  std::vector<uint32_t> order_;   // scratch of unitedLoop
  std::priority_queue<Candidate> queue_;
  double meanArea_ = 0;
};

// Numbers labels by their first occurrence.
Regions numbered(const std::vector<uint32_t>& labels) {
  constexpr uint32_t kNone = ~0u;
  Regions regions{std::vector<uint32_t>(labels.size()), 0};
  std::vector<uint32_t> numbers(labels.size(), kNone);
  for (size_t t = 0; t < labels.size(); ++t) {
    uint32_t& number = numbers[labels[t]];
    if (number == kNone) number = static_cast<uint32_t>(regions.count++);
    regions.ofTriangle[t] = number;
  }
  return regions;
}

} // namespace

std::vector<std::vector<uint32_t>> Regions::triangles() const {
  std::vector<std::vector<uint32_t>> result(count);
  for (uint32_t t = 0; t < ofTriangle.size(); ++t) result[ofTriangle[t]].push_back(t);
  return result;
}

Regions regionsOf(const TriangleMesh& mesh, const RegionOptions& options, const Progress& progress) {
  if (mesh.triangles.empty()) throw Error("has no triangles").at("mesh");
  const TriangleGraph graph = triangleGraph(mesh, progress);
  Merging merging(mesh, graph, options);
  merging.run(progress);
  return numbered(merging.labels());
}

} // namespace surflect::slf
