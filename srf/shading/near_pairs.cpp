#include "srf/shading/near_pairs.h"

#include "srf/shading/pair_kernels.h"
#include "srf/ulr/ulr.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace surflect::shading {

namespace {

using Directions = std::vector<Direction3<AcquisitionSpace>>;

// For each direction, the indices of the kNearSources nearest, itself among them.
std::vector<std::vector<uint32_t>> neighbourhoods(const Directions& towards) {
  std::vector<std::vector<uint32_t>> all;
  for (const auto& centre : towards) {
    std::vector<uint32_t> nearest(towards.size());
    std::iota(nearest.begin(), nearest.end(), 0u);
    const auto count = static_cast<std::ptrdiff_t>(std::min(kNearSources, nearest.size()));
    std::ranges::partial_sort(nearest, nearest.begin() + count, {},
                              [&](uint32_t i) { return ulr::anglePenalty(towards[i], centre); });
    nearest.resize(static_cast<size_t>(count));
    all.push_back(std::move(nearest));
  }
  return all;
}

} // namespace

bool hasNearPairs(const ReflectanceField& field) {
  if (field.isFullProduct) return true;
  Directions towardsViews, towardsLights;
  for (const capture::View& view : field.rig.views)
    towardsViews.push_back(capture::Viewpoint(view.camera).towards(field.middle).cast<float>());
  for (const capture::Light& light : field.rig.lights)
    towardsLights.push_back(capture::towardsLight(light, field.middle).cast<float>());
  const size_t lights = towardsLights.size();
  std::vector<uint8_t> isMissing(towardsViews.size() * lights, 1);
  for (size_t view = 0; view < field.columns.size(); ++view)
    for (const uint32_t light : field.columns[view]) isMissing[view * lights + light] = 0;
  const auto nearViews = neighbourhoods(towardsViews), nearLights = neighbourhoods(towardsLights);
  return std::ranges::all_of(nearViews, [&](const auto& views) {
    return std::ranges::all_of(nearLights, [&](const auto& ofLight) {
      size_t missing = 0;
      for (const uint32_t view : views)
        for (const uint32_t light : ofLight) missing += isMissing[view * lights + light];
      return 4 * missing <= views.size() * ofLight.size();
    });
  });
}

} // namespace surflect::shading
