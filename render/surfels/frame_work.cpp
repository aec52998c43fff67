#include "render/surfels/frame_work.h"

namespace surflect::surfels {

std::map<std::string, double> workOf(const FrameStats& stats, const FrameOptions& options, size_t pixels) {
  const auto n = static_cast<double>(stats.surfels), p = static_cast<double>(pixels);
  const auto drawn = static_cast<double>(stats.splats.drawn), visible = static_cast<double>(stats.visible);
  const auto asked = static_cast<double>(stats.queries);
  const double lit = asked * static_cast<double>(stats.lights);
  const shading::ShadingStats& shading = stats.shading;
  const auto operations = static_cast<double>(shading.operations);
  const auto lookups = static_cast<double>(shading.lookups);
  const double lookupsAsked = visible > 0 ? lookups * asked / visible : 0;
  // Nanoseconds for each thing that is counted.
  return {{"warp", (options.surfelSize > 0 ? 21 : 8) * n},
          {"splat", 15 * n + (options.splats.searchLayers ? 120 : 100) * drawn + 15 * p},
          {"queries", 20 * asked + 0.8 * lit},
          {"ulr", 80 * asked + 28 * lit + 3 * operations + 4.5 * lookupsAsked},
          {"look-up", 60 * operations + 2.5 * lookups},
          {"develop", 20 * visible + 7 * p}};
}

} // namespace surflect::surfels
