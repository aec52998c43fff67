#include "render/surfels/frame_work.h"

namespace surflect::surfels {

std::map<std::string, double> workOf(const FrameStats& stats, size_t surfels, size_t pixels) {
  const auto n = static_cast<double>(surfels), p = static_cast<double>(pixels);
  const auto drawn = static_cast<double>(stats.splats.drawn), visible = static_cast<double>(stats.visible);
  const double lit = visible * static_cast<double>(stats.lights);
  const shading::ShadingStats& shading = stats.shading;
  const auto operations = static_cast<double>(shading.operations);
  const auto lookups = static_cast<double>(shading.lookups);
  // Nanoseconds for each thing that is counted.
  return {{"warp", 8 * n},
          {"splat", 15 * n + 120 * drawn + 15 * p},
          {"queries", 20 * visible + 0.8 * lit},
          {"ulr", 80 * visible + 28 * lit + 3 * operations + 4.5 * lookups},
          {"look-up", 60 * operations + 2.5 * lookups},
          {"develop", 20 * visible + 7 * p}};
}

} // namespace surflect::surfels
