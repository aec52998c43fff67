#include "srf/ulr/opacity_hull_weights.h"

#include "srf/ulr/resolution_fade.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

namespace surflect::ulr {

VisibilityWeights opacityHullWeights(const SurfelCloud& cloud,
                                     std::span<const capture::Camera<AcquisitionSpace>> views,
                                     const Progress& progress) {
  VisibilityWeights result{views.size(), std::vector<uint8_t>(cloud.size() * views.size())};
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints;
  for (const auto& view : views) viewpoints.emplace_back(view);
  progress("view fades", 0);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, cloud.size(), 1024), [&](const auto& range) {
    progress.checkpoint();
    std::vector<double> weights(views.size()), densities(views.size());
    for (size_t i = range.begin(); i < range.end(); ++i) {
      const auto p = cloud.p0[i].cast<double>();
      for (size_t view = 0; view < views.size(); ++view) {
        const auto pixel = views[view].project(p);
        weights[view] = pixel ? borderFade(views[view].lens, *pixel) : 0;
        densities[view] = samplingDensity(views[view], viewpoints[view], p);
      }
      fadeByResolution(weights, densities);
      std::ranges::transform(weights, &result.values[i * views.size()], VisibilityWeights::encode);
    }
  });
  return result;
}

} // namespace surflect::ulr
