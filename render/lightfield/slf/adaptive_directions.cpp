#include "render/lightfield/slf/adaptive_directions.h"

#include "render/lightfield/slf/resample.h"
#include "srf/ulr/ulr.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace surflect::slf {

namespace {

DirectionMesh meshOf(const DirectionMesh& fine, const std::vector<size_t>& kept) {
  std::vector<Direction> directions;
  for (const size_t i : kept) directions.push_back(fine.directions()[i]);
  return DirectionMesh(std::move(directions));
}

} // namespace

DirectionalRadiance directionalRadiance(const Observations& observations, const DirectionMesh& fine,
                                        Blend blend) {
  std::vector<size_t> seen;
  for (size_t texel = 0; texel < observations.texels(); ++texel)
    if (!observations.of(texel).empty()) seen.push_back(texel);
  const size_t judged = std::min(seen.size(), kJudgedTexels), count = fine.directions().size();
  DirectionalRadiance result{std::vector(count, std::vector<Vec3<float>>(judged)),
                             std::vector(count, std::vector<uint8_t>(judged))};
  const std::vector<uint8_t> all(count, 1);
  const std::vector<float> spacings = spacingPenalties(fine);
  tbb::parallel_for(size_t{0}, judged, [&](size_t t) {
    const std::span<const Observation> those = observations.of(seen[t * seen.size() / judged]);
    const std::vector<Vec3<float>> radiance = texelRadiance(blend, those, fine, all);
    for (size_t i = 0; i < count; ++i) {
      result.radiance[i][t] = radiance[i];
      const auto r = fine.directions()[i].cast<float>();
      result.isObserved[i][t] = std::ranges::any_of(those, [&](const Observation& observation) {
        return ulr::anglePenalty(observation.towards, r) <= spacings[i];
      });
    }
  });
  return result;
}

std::vector<double> reproductionErrors(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                       const std::vector<size_t>& kept, const DirectionMesh& mesh) {
  std::vector<double> errors(fine.directions().size(), 0.0);
  for (size_t i = 0; i < errors.size(); ++i) {
    if (std::ranges::binary_search(kept, i)) continue;
    const HatWeights hats = mesh.weightsAt(fine.directions()[i]);
    double sum = 0;
    size_t observed = 0;
    for (size_t t = 0; t < radiance.radiance[i].size(); ++t) {
      if (!radiance.isObserved[i][t]) continue;
      Vec3<float> difference = radiance.radiance[i][t];
      for (size_t c = 0; c < 3; ++c)
        difference -= static_cast<float>(hats.weights[c]) * radiance.radiance[kept[hats.directions[c]]][t];
      sum += static_cast<double>(difference.squaredNorm());
      ++observed;
    }
    if (observed > 0) errors[i] = std::sqrt(sum / (3 * static_cast<double>(observed)));
  }
  return errors;
}

std::vector<size_t> adaptedDirections(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                      double tolerance) {
  std::vector<size_t> kept(6);
  std::iota(kept.begin(), kept.end(), size_t{0});
  while (kept.size() < fine.directions().size()) {
    const std::vector<double> errors = reproductionErrors(radiance, fine, kept, meshOf(fine, kept));
    const auto worst = std::ranges::max_element(errors);
    if (!(*worst > tolerance)) break;
    const auto index = static_cast<size_t>(worst - errors.begin());
    kept.insert(std::ranges::upper_bound(kept, index), index);
  }
  return kept;
}

} // namespace surflect::slf
