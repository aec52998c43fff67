#include "render/lightfield/slf/regions.h"

#include "render/lightfield/slf/region_merging.h"
#include "render/lightfield/slf/region_smoothing.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/error.h"

#include <utility>

namespace surflect::slf {

namespace {

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
  const std::vector<RegionMoments> moments = triangleMoments(mesh);
  Regions regions = numbered(mergedRegions(mesh, graph, moments, options, progress));
  smoothRegions(mesh, graph, moments, options, regions, progress);
  return numbered(regions.ofTriangle);
}

} // namespace surflect::slf
