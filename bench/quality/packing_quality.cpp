#include "bench/quality/packing_quality.h"

#include "srf/model/white_level.h"
#include "surfel/base/error.h"

#include <cmath>
#include <string>

namespace surflect::bench {

namespace {

PackingQuality packed(std::span<const codec::ReflectanceStack> views, double tolerance, double white,
                      const Progress& progress) {
  codec::ViewSummary sum;
  for (const codec::ReflectanceStack& view : views)
    sum += codec::encodeView(view, {.tolerance = tolerance, .white = white}, progress).summary;
  const size_t lights = views[0].lights.size();
  const double values = static_cast<double>(sum.objectTexels * lights);
  return {tolerance,
          static_cast<double>(sum.fileBytes) / values,
          codec::psnrDb(sum, white),
          sum.objectTexels,
          lights,
          white};
}

} // namespace

PackingQuality qualityAt(double bytes, std::span<const codec::ReflectanceStack> views,
                         const Progress& progress) {
  model::WhiteLevel white;
  for (const codec::ReflectanceStack& view : views) white.add(view, image::objectMask(view.alpha), progress);
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

} // namespace surflect::bench
