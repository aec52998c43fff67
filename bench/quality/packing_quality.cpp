#include "bench/quality/packing_quality.h"

#include "srf/model/white_level.h"
#include "surfel/base/error.h"

#include <cmath>
#include <string>

namespace surflect {

namespace {

PackingQuality packed(std::span<const ReflectanceStack> views, double tolerance, double white,
                      const Progress& progress) {
  ViewSummary sum;
  for (const ReflectanceStack& view : views)
    sum += encodeView(view, {.tolerance = tolerance, .white = white}, progress).summary;
  const size_t lights = views[0].lights.size();
  const double values = static_cast<double>(sum.objectTexels * lights);
  return {
      tolerance, static_cast<double>(sum.fileBytes) / values, psnrDb(sum, white), sum.objectTexels, lights,
      white};
}

} // namespace

PackingQuality qualityAt(double bytes, std::span<const ReflectanceStack> views, const Progress& progress) {
  WhiteLevel white;
  for (const ReflectanceStack& view : views) white.add(view, objectMask(view.alpha), progress);
  if (!white.isKnown()) throw Error("no photograph shows anything of the object");
  double fine = 0.005, coarse = 0.5; // too many bytes; few enough
  PackingQuality best = packed(views, coarse, white.value(), progress);
  if (best.bytes > bytes)
    throw Error::mismatch("at most " + std::to_string(bytes) + " bytes for each pixel and light",
                          std::to_string(best.bytes) + " at a tolerance of " + std::to_string(coarse));
  constexpr double kNear = 0.999;
  while (best.bytes < kNear * bytes && coarse / fine > 1.001) {
    const double between = std::sqrt(fine * coarse);
    const PackingQuality quality = packed(views, between, white.value(), progress);
    if (quality.bytes <= bytes) {
      best = quality;
      coarse = between;
    } else {
      fine = between;
    }
  }
  return best;
}

} // namespace surflect
