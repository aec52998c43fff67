// Work of a frame's stages. Bytes are those of single precision in arrays: point, direction or colour 12,
// tangent frame 12, flag 1, weight 4. Operations are counted in the equations; a square root or division is
// one.
#include "bench/frame/stage_bounds.h"

#include <algorithm>

namespace surflect::bench {

std::vector<StageWork> workOf(const FrameCounts& counts) {
  const auto real = [](auto count) { return static_cast<double>(count); };
  const double surfels = real(counts.surfels), drawn = real(counts.drawn), visible = real(counts.visible);
  const double pixels = real(counts.pixels), contributions = real(counts.contributions);
  const double views = real(counts.views), rigLights = real(counts.rigLights), lights = real(counts.lights);
  const double pairs = real(counts.pairs), lookups = real(counts.lookups), rank = counts.rank;
  return {
      // In: p0, r0. Out: p, u, v, flag. Frame of r0 20, warp with sine and cosine 60, its Jacobian on u0 and
      // v0 50, handedness 20.
      {"warp", surfels * (24 + 37), surfels * 150},
      // In: p, u, v, flag, radius, coverage. Out: footprints of visible splats (x, y, three for the ellipse,
      // peak, three for the depth), and alpha and depth of each pixel. Place and facing of every surfel 30,
      // ellipse of drawn splats 150, ellipse, area and depth of a contribution 30.
      {"splat", surfels * 45 + visible * 36 + pixels * 8, surfels * 30 + drawn * 150 + contributions * 30},
      // In: index, p, u, v, r0. Out: directions to viewer and lights, irradiance. Polar factor 60, R0 20, L
      // 45, direction to the viewer 25; a light and its irradiance 40.
      {"queries", visible * (52 + 12 + 24 * lights), visible * (150 + 40 * lights)},
      // In: p0, directions, irradiance, and a byte of visibility per view. Out: blended views (index,
      // weight). A scalar product for each view, and for each pair of captured light and light of the shot.
      {"ulr", visible * (24 + views + 24 * lights) + pairs * 8, visible * (views + lights * rigLights) * 6},
      // In: each block once; view, weight and place of each pair. Out: radiance. Weighting coefficients by
      // lights: a multiply-add per term, channel and light. Four taps and the sum, per term and channel.
      {"look-up", real(counts.blockBytes) + pairs * 16 + visible * 12,
       lookups * rank * 6 + pairs * rank * 30},
      // In: footprint, radiance, confidence, and the pixels' depth and alpha. Out: RGBA. Ellipse, Gaussian
      // and depth of each contribution 30 again, as storing and reloading them would take as long as 100.
      // Confidence, and a multiply-add per channel.
      {"develop", visible * (36 + 16) + pixels * (8 + 16), contributions * (30 + 7)},
  };
}

bool isBoundByMemory(const StageWork& work, const MachineLimits& limits) {
  return work.bytes / limits.bytesPerSecond > work.operations / limits.flopsPerSecond;
}

double boundSeconds(const StageWork& work, const MachineLimits& limits) {
  return std::max(work.bytes / limits.bytesPerSecond, work.operations / limits.flopsPerSecond);
}

} // namespace surflect::bench
