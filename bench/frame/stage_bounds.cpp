// Bytes are those of single precision in arrays: point, direction, colour 12; tangent frame 12; flag 1;
// weight 4. Operations are counted on the equations, a square root or a division as one.
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
      // p0, r0 in; p, u, v, flag out. Frame of r0 20, warp with sine and cosine 60, its Jacobian on u0 and v0
      // 50,
      // handedness 20.
      {"warp", surfels * (24 + 37), surfels * 150},
      // p, u, v, flag, radius, coverage in; footprints of visible splats (x, y, three of the ellipse, peak,
      // three of
      // the depth) out, and for each pixel alpha and how deep it shows splats. Place and facing of every
      // surfel 30,
      // ellipse of those drawn 150, ellipse, area and depth of a contribution 30.
      {"splat", surfels * 45 + visible * 36 + pixels * 8, surfels * 30 + drawn * 150 + contributions * 30},
      // index, p, u, v, r0 in; directions to viewer and lights and irradiance out. Polar factor 60, R0 20, L
      // 45,
      // direction to the viewer 25; to a light with its irradiance 40.
      {"queries", visible * (52 + 12 + 24 * lights), visible * (150 + 40 * lights)},
      // p0, directions, irradiance and a byte of visibility a view in; blended views (index, weight) out. A
      // scalar
      // product for each view, and for each captured light and light of the shot.
      {"ulr", visible * (24 + views + 24 * lights) + pairs * 8, visible * (views + lights * rigLights) * 6},
      // Blocks in, each once; view, weight and place of each pair; radiance out. Light weights times
      // coefficients, a
      // multiply-add a term, channel and light; four taps and the sum, of a term and channel each.
      {"look-up", real(counts.blockBytes) + pairs * 16 + visible * 12,
       lookups * rank * 6 + pairs * rank * 30},
      // Footprint, radiance and confidence in, and what pixels have; RGBA out. Ellipse, Gaussian and depth of
      // a
      // contribution again 30: to store and read it would take as long as 100. Confidence, and a multiply-add
      // a channel.
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
