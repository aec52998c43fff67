#include "render/lightfield/slf/resample.h"

#include "render/lightfield/common/pull_push.h"
#include "render/lightfield/slf/blackout_cone.h"
#include "srf/image/half_float.h"
#include "srf/weights/ulr.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace surflect::slf {

namespace {

// Fills the texels of one texture that no photograph sees.
void fillUnseen(std::vector<Texel>& texture, int width, const Observations& observations) {
  std::vector<Eigen::Vector4f> values(texture.size());
  for (size_t texel = 0; texel < texture.size(); ++texel)
    for (size_t c = 0; c < 4; ++c)
      values[texel][static_cast<Eigen::Index>(c)] =
          c < 3 ? image::floatOfHalf(texture[texel][c]) : (observations.of(texel).empty() ? 0.f : 1.f);
  lightfield::pullPush(values, width, static_cast<int>(texture.size()) / width);
  for (size_t texel = 0; texel < texture.size(); ++texel)
    if (observations.of(texel).empty()) texture[texel] = texelOf(values[texel].head<3>(), false);
}

// Is a photograph near enough to a direction for the texel to count as observed?
bool isObserved(std::span<const Observation> observations, const Direction3<AcquisitionSpace>& r,
                float spacing) {
  return std::ranges::any_of(observations, [&](const Observation& observation) {
    return weights::anglePenalty(observation.towards, r) <= spacing;
  });
}

} // namespace

Observations::Observations(std::span<const TexelPoint> points, const TriangleMesh& mesh,
                           const SmoothNormals& normals, const lightfield::Sight& sight) {
  std::vector<std::vector<Observation>> seen(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t texel) {
    const TexelPoint& point = points[texel];
    if (point.meshTriangle != TexelPoint::kNone)
      seen[texel] =
          sight.observations(lightfield::surfacePoint(mesh, normals, point.meshTriangle, point.position));
  });
  first_.push_back(0);
  for (const std::vector<Observation>& observations : seen) {
    all_.insert(all_.end(), observations.begin(), observations.end());
    first_.push_back(all_.size());
  }
}

std::vector<uint8_t> usedDirections(const TriangleMesh& mesh, const Chart& chart,
                                    const DirectionMesh& directions) {
  const size_t count = directions.directions().size();
  std::vector<uint8_t> isInFront(count, 0), isUsed(count, 0);
  for (const uint32_t triangle : chart.meshTriangles) {
    const Vec3<double> area = areaVector(mesh, triangle);
    if (!(area.squaredNorm() > 0)) continue;
    const Vec3<double> normal = area.normalized();
    for (size_t i = 0; i < count; ++i)
      if (directions.directions()[i].raw().dot(normal) > -std::sin(kTurnOver)) isInFront[i] = 1;
  }
  // A direction between corners that are all behind is behind too.
  for (const auto& corners : directions.triangles())
    if (std::ranges::any_of(corners, [&](uint32_t corner) { return isInFront[corner] == 1; }))
      for (const uint32_t corner : corners) isUsed[corner] = 1;
  return isUsed;
}

Texel texelOf(const Vec3<float>& radiance, bool isObserved) {
  Texel texel{};
  for (size_t c = 0; c < 3; ++c) texel[c] = image::finiteHalf(radiance[static_cast<Eigen::Index>(c)]);
  texel[3] = image::nearestHalf(isObserved ? 1.f : 0.f);
  return texel;
}

std::vector<float> spacingPenalties(const DirectionMesh& directions) {
  std::vector<float> spacings(directions.directions().size(), 0.f);
  for (const auto& corners : directions.triangles())
    for (size_t corner = 0; corner < 3; ++corner) {
      const uint32_t a = corners[corner], b = corners[(corner + 1) % 3];
      const auto penalty =
          static_cast<float>(weights::anglePenalty(directions.directions()[a], directions.directions()[b]));
      spacings[a] = std::max(spacings[a], penalty);
      spacings[b] = std::max(spacings[b], penalty);
    }
  return spacings;
}

RegionTextures resample(const Observations& observations, int width, const DirectionMesh& directions,
                        std::span<const uint8_t> isUsed, Blend blend) {
  const size_t count = directions.directions().size();
  assert(isUsed.size() == count);
  RegionTextures result{std::vector<std::vector<Texel>>(count), 0, observations.texels()};
  for (size_t i = 0; i < count; ++i)
    if (isUsed[i]) result.textures[i].resize(result.texels);
  const std::vector<float> spacings = spacingPenalties(directions);
  tbb::parallel_for(size_t{0}, result.texels, [&](size_t texel) {
    const std::span<const Observation> seen = observations.of(texel);
    if (seen.empty()) return;
    const std::vector<Vec3<float>> radiance = texelRadiance(blend, seen, directions, isUsed);
    for (size_t i = 0; i < count; ++i)
      if (isUsed[i])
        result.textures[i][texel] =
            texelOf(radiance[i], isObserved(seen, directions.directions()[i].cast<float>(), spacings[i]));
  });
  for (size_t texel = 0; texel < result.texels; ++texel)
    if (observations.of(texel).empty()) ++result.unseenTexels;
  if (result.unseenTexels > 0 && !result.isUnseen())
    tbb::parallel_for(size_t{0}, count, [&](size_t i) {
      if (isUsed[i]) fillUnseen(result.textures[i], width, observations);
    });
  return result;
}

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
