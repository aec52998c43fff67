#include "render/lightfield/slf/resample.h"

#include "render/lightfield/common/pull_push.h"
#include "srf/image/half_float.h"
#include "srf/ulr/ulr.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

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
    return ulr::anglePenalty(observation.towards, r) <= spacing;
  });
}

} // namespace

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
          static_cast<float>(ulr::anglePenalty(directions.directions()[a], directions.directions()[b]));
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

} // namespace surflect::slf
