#include "render/lightfield/slf/adaptive_directions.h"

#include "srf/weights/ulr.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
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

// Errors of the fine directions while directions are added to those that are kept. A direction's error
// changes only with the triangle that holds it.
class Reproductions {
public:
  Reproductions(const DirectionalRadiance& radiance, const DirectionMesh& fine)
      : radiance_(radiance), fine_(fine), corners_(fine.directions().size()),
        errors_(fine.directions().size(), 0.0) {}

  // By fine direction.
  const std::vector<double>& errors() const { return errors_; }

  void update(const std::vector<size_t>& kept, const DirectionMesh& mesh) {
    for (size_t i = 0; i < errors_.size(); ++i) {
      if (std::ranges::binary_search(kept, i)) {
        errors_[i] = 0;
        continue;
      }
      const HatWeights hats = mesh.weightsAt(fine_.directions()[i]);
      std::array<size_t, 3> corners{};
      for (size_t c = 0; c < 3; ++c) corners[c] = kept[hats.directions[c]];
      if (corners != std::exchange(corners_[i], corners)) errors_[i] = errorOf(i, corners, hats.weights);
    }
  }

private:
  double errorOf(size_t i, const std::array<size_t, 3>& corners, const std::array<double, 3>& weights) const {
    double sum = 0;
    size_t observed = 0;
    for (size_t t = 0; t < radiance_.radiance[i].size(); ++t) {
      if (!radiance_.isObserved[i][t]) continue;
      Vec3<float> difference = radiance_.radiance[i][t];
      for (size_t c = 0; c < 3; ++c)
        difference -= static_cast<float>(weights[c]) * radiance_.radiance[corners[c]][t];
      sum += static_cast<double>(difference.squaredNorm());
      ++observed;
    }
    return observed > 0 ? std::sqrt(sum / (3 * static_cast<double>(observed))) : 0;
  }

  const DirectionalRadiance& radiance_;
  const DirectionMesh& fine_;
  // Corners of the triangle of kept directions that holds each fine direction; no triangle at first.
  std::vector<std::array<size_t, 3>> corners_;
  std::vector<double> errors_;
};

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
        return weights::anglePenalty(observation.towards, r) <= spacings[i];
      });
    }
  });
  return result;
}

std::vector<double> reproductionErrors(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                       const std::vector<size_t>& kept, const DirectionMesh& mesh) {
  Reproductions reproductions(radiance, fine);
  reproductions.update(kept, mesh);
  return reproductions.errors();
}

std::vector<size_t> adaptedDirections(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                      double tolerance) {
  std::vector<size_t> kept(6);
  std::iota(kept.begin(), kept.end(), size_t{0});
  Reproductions reproductions(radiance, fine);
  while (kept.size() < fine.directions().size()) {
    reproductions.update(kept, meshOf(fine, kept));
    const std::vector<double>& errors = reproductions.errors();
    const auto worst = std::ranges::max_element(errors);
    if (!(*worst > tolerance)) break;
    const auto index = static_cast<size_t>(worst - errors.begin());
    kept.insert(std::ranges::upper_bound(kept, index), index);
  }
  return kept;
}

} // namespace surflect::slf
