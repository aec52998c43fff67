#include "render/lightfield/slf/unseen_regions.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <map>

namespace surflect::slf {

namespace {

// Neighbours of each region, with the number of shared vertices.
std::vector<std::map<size_t, int>> neighborsOf(std::span<const Chart> charts) {
  std::map<uint32_t, std::vector<size_t>> regionsAt;
  for (size_t region = 0; region < charts.size(); ++region)
    for (const uint32_t vertex : charts[region].vertices) regionsAt[vertex].push_back(region);
  std::vector<std::map<size_t, int>> neighbors(charts.size());
  for (const auto& [vertex, regions] : regionsAt)
    for (const size_t a : regions)
      for (const size_t b : regions)
        if (a != b) ++neighbors[a][b];
  return neighbors;
}

} // namespace

void fillUnseenRegions(std::span<const Chart> charts, std::vector<MeanRadiance>& means) {
  assert(means.size() == charts.size());
  const auto neighbors = neighborsOf(charts);
  for (bool isChanged = true; isChanged;) {
    isChanged = false;
    const std::vector<MeanRadiance> known = means;
    for (size_t region = 0; region < charts.size(); ++region) {
      if (!known[region].empty()) continue;
      float shared = 0;
      for (const auto& [neighbor, vertices] : neighbors[region]) {
        if (known[neighbor].empty()) continue;
        means[region].resize(known[neighbor].size(), Vec3<float>::Zero());
        for (size_t i = 0; i < known[neighbor].size(); ++i)
          means[region][i] += static_cast<float>(vertices) * known[neighbor][i];
        shared += static_cast<float>(vertices);
      }
      for (Vec3<float>& mean : means[region]) mean /= shared;
      isChanged = isChanged || shared > 0;
    }
  }
}

} // namespace surflect::slf
