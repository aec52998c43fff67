#include "render/surfels/frame_work.h"

namespace surflect::surfels {

std::map<std::string, double> workOf(const FrameStats& stats, const FrameOptions& options, size_t pixels) {
  const auto count = [](size_t number) { return static_cast<double>(number); };
  const double surfels = count(stats.surfels), drawn = count(stats.splats.drawn);
  const double visible = count(stats.visible), queries = count(stats.queries);
  const auto operations = count(stats.shading.operations), lookups = count(stats.shading.lookups);
  const bool isCut = options.surfelSize > 0, sharesWeights = stats.queries < stats.visible;
  const double pairLights = count(stats.pairLights), occluders = count(stats.occluders);
  // Nanoseconds for each thing that is counted, fitted to frames of the example films.
  return {{"warp",
           9 * surfels + (isCut ? count(stats.cloud) : 0) + (stats.surfels < stats.cloud ? 4 * surfels : 0)},
          {"shadows", 800 * occluders},
          {"splat", 5 * surfels + (options.splats.searchLayers ? 130 : 95) * drawn +
                        32 * count(stats.covered) + 6 * count(pixels)},
          {"queries", (26 + 47 * count(stats.environments)) * queries + (sharesWeights ? 8 * visible : 0) +
                          (occluders > 0 ? 290 * pairLights * visible : 0)},
          {"ulr", (136 + 28 * count(stats.lights) + 1300 * pairLights + 13 * count(stats.tabulatedLights)) *
                          queries +
                      (30 + 400 * pairLights) * visible},
          {"look-up", 46 * operations + 3.7 * lookups},
          {"develop", 24 * visible + 6 * count(pixels)}};
}

} // namespace surflect::surfels
