#include "render/lightfield/slf/texel_radiance.h"

#include "srf/weights/ulr.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

namespace surflect::slf {

namespace {

// Radiance with non-negative channels, as photographs' noise may be below 0.
Vec3<float> notBelowZero(const Vec3<float>& radiance) { return radiance.cwiseMax(0.f); }

// Hat functions at the directions of observations, and the sample directions with any of them.
struct Hats {
  std::vector<HatWeights> at;      // #observations
  std::vector<uint32_t> unknowns;  // sample directions
  std::vector<Eigen::Index> place; // #directions: index into unknowns, or -1
};

Hats hatsAt(std::span<const Observation> observations, const DirectionMesh& directions) {
  Hats hats{{}, {}, std::vector<Eigen::Index>(directions.directions().size(), -1)};
  uint32_t triangle = 0;
  for (const Observation& observation : observations) {
    const HatWeights& weights =
        hats.at.emplace_back(directions.weightsAt(observation.towards.cast<double>(), triangle));
    triangle = weights.triangle;
    for (const uint32_t direction : weights.directions) {
      if (hats.place[direction] >= 0) continue;
      hats.place[direction] = static_cast<Eigen::Index>(hats.unknowns.size());
      hats.unknowns.push_back(direction);
    }
  }
  return hats;
}

} // namespace

std::vector<Vec3<float>> nearestRadiance(std::span<const Observation> observations,
                                         const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  assert(!observations.empty());
  std::vector<Vec3<float>> radiance(isUsed.size(), Vec3<float>::Zero());
  for (size_t i = 0; i < radiance.size(); ++i) {
    if (!isUsed[i]) continue;
    const auto r = directions.directions()[i].cast<float>();
    float least = std::numeric_limits<float>::infinity();
    for (const Observation& observation : observations) {
      const float penalty = weights::anglePenalty(observation.towards, r);
      if (penalty < least) least = penalty, radiance[i] = observation.radiance;
    }
    radiance[i] = notBelowZero(radiance[i]);
  }
  return radiance;
}

std::vector<Vec3<float>> blendedRadiance(std::span<const Observation> observations,
                                         const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  assert(!observations.empty());
  std::vector<Vec3<float>> radiance(isUsed.size(), Vec3<float>::Zero());
  for (size_t i = 0; i < radiance.size(); ++i) {
    if (!isUsed[i]) continue;
    const auto r = directions.directions()[i].cast<float>();
    weights::NearestCandidates nearest(kBlended);
    for (uint32_t v = 0; v < observations.size(); ++v)
      nearest.offer({v, weights::anglePenalty(observations[v].towards, r) / observations[v].fade});
    for (const auto& [v, weight] : weights::ulrWeights(nearest))
      radiance[i] += weight * observations[v].radiance;
    radiance[i] = notBelowZero(radiance[i]);
  }
  return radiance;
}

std::vector<Vec3<float>> fittedRadiance(std::span<const Observation> observations,
                                        const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  std::vector<Vec3<float>> radiance = blendedRadiance(observations, directions, isUsed);
  const Hats hats = hatsAt(observations, directions);
  // Normal equations of the differences F_i - U_i.
  const auto unknowns = static_cast<Eigen::Index>(hats.unknowns.size());
  Eigen::MatrixXd normal = kPrior * Eigen::MatrixXd::Identity(unknowns, unknowns);
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns, 3);
  for (size_t v = 0; v < observations.size(); ++v) {
    const HatWeights& hat = hats.at[v];
    const double f = static_cast<double>(observations[v].fade);
    Vec3<double> residual = observations[v].radiance.cast<double>();
    for (size_t c = 0; c < 3; ++c) residual -= hat.weights[c] * radiance[hat.directions[c]].cast<double>();
    for (size_t c = 0; c < 3; ++c) {
      const Eigen::Index row = hats.place[hat.directions[c]];
      right.row(row) += f * hat.weights[c] * residual.transpose();
      for (size_t d = 0; d < 3; ++d)
        normal(row, hats.place[hat.directions[d]]) += f * hat.weights[c] * hat.weights[d];
    }
  }
  const Eigen::MatrixX3d difference = normal.llt().solve(right);
  for (Eigen::Index i = 0; i < unknowns; ++i) {
    const uint32_t direction = hats.unknowns[static_cast<size_t>(i)];
    if (isUsed[direction])
      radiance[direction] = notBelowZero(radiance[direction] + difference.row(i).transpose().cast<float>());
  }
  return radiance;
}

std::vector<Vec3<float>> texelRadiance(Blend blend, std::span<const Observation> observations,
                                       const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  switch (blend) {
  case Blend::nearest:
    return nearestRadiance(observations, directions, isUsed);
  case Blend::ulr:
    return blendedRadiance(observations, directions, isUsed);
  case Blend::fitted:
    break;
  }
  return fittedRadiance(observations, directions, isUsed);
}

} // namespace surflect::slf
