#include "srf/planes/light_choice.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace surflect::planes {

std::vector<size_t> farApart(std::span<const Vec3<double>> towardsLights, size_t most) {
  Vec3<double> mean = Vec3<double>::Zero();
  for (const Vec3<double>& towards : towardsLights)
    mean += towards / static_cast<double>(towardsLights.size());
  // Squared distance of each to the nearest chosen one; to the mean before the first is chosen.
  std::vector<double> distances;
  for (const Vec3<double>& towards : towardsLights) distances.push_back((towards - mean).squaredNorm());
  std::vector<size_t> chosen;
  while (chosen.size() < std::min(most, towardsLights.size())) {
    const auto next = static_cast<size_t>(std::ranges::max_element(distances) - distances.begin());
    for (size_t l = 0; l < distances.size(); ++l) {
      const double distance = (towardsLights[l] - towardsLights[next]).squaredNorm();
      distances[l] = chosen.empty() ? distance : std::min(distances[l], distance);
    }
    distances[next] = -1; // lamps at one place are chosen once each
    chosen.push_back(next);
  }
  std::ranges::sort(chosen);
  return chosen;
}

std::vector<size_t> withoutPeriod(size_t count, size_t most) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  std::set<size_t> chosen;
  for (size_t i = 0; chosen.size() < std::min(count, most); ++i) {
    const double turns = golden * static_cast<double>(i);
    chosen.insert(static_cast<size_t>((turns - std::floor(turns)) * static_cast<double>(count)));
  }
  return {chosen.begin(), chosen.end()};
}

} // namespace surflect::planes
