#include "srf/weights/shadow_state.h"

#include "srf/weights/fades.h"
#include "srf/weights/nearest_sources.h"

#include <tbb/parallel_for.h>

namespace surflect::weights {

VisibilityWeights shadowStates(const SurfelCloud& cloud, const Occluders& occluders,
                               std::span<const capture::Light> lights, const Progress& progress) {
  VisibilityWeights result{lights.size(), std::vector<uint8_t>(cloud.size() * lights.size())};
  if (cloud.size() == 0 || lights.empty()) return result;
  progress("shadows", 0);
  const auto viewpoints = viewpointsOf(lights);
  const SplatCaster<AcquisitionSpace> caster = casterOf(occluders, cloud, progress);
  const auto normalOf = [&](size_t i) {
    return assume<Normal3<AcquisitionSpace>>(rotationOf<float>(cloud.r0[i]).col(2));
  };
  const auto forSurfels = [&](const auto& work) {
    tbb::parallel_for(size_t{0}, cloud.size(), [&](size_t i) {
      progress.checkNowAndThen(i);
      work(i);
    });
  };
  std::vector<uint8_t> free(result.values.size());
  forSurfels([&](size_t i) {
    const auto p = cloud.p0[i].cast<double>();
    const auto normal = normalOf(i).cast<double>();
    for (size_t light = 0; light < lights.size(); ++light)
      free[i * lights.size() + light] = reaching(caster, p, normal, viewpoints[light].towards(p),
                                                 viewpoints[light].distance(p), occluders.clearance) >= 0.5f;
  });
  progress("shadows", 0.5);
  const SmoothedVisibility votes(cloud, viewpoints, std::move(free), visibilityRadius(cloud), progress);
  forSurfels([&](size_t i) {
    std::vector<float> reached(lights.size());
    votes.at(cloud.p0[i], normalOf(i), reached);
    const auto p = cloud.p0[i].cast<double>();
    for (size_t light = 0; light < lights.size(); ++light) {
      // Votes are those of neighbours that face the light, whether or not the surfel does.
      const double facing = terminatorFade(dot(normalOf(i).cast<double>(), viewpoints[light].towards(p)));
      result.values[i * lights.size() + light] = VisibilityWeights::encode(facing * reached[light]);
    }
  });
  progress("shadows", 1);
  return result;
}

} // namespace surflect::weights
