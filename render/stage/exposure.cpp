#include "render/stage/exposure.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surflect::stage {

namespace {

// [Box 1958] A note on the generation of random normal deviates.
double normal(Random& random) {
  const double u = 1 - random.next(), v = random.next();
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

} // namespace

uint8_t codeOf(const image::Response& response, float x) {
  const auto& curve = response.exposure[0];
  const auto above = std::ranges::lower_bound(curve, x); // first element not below x
  if (above == curve.begin() || std::isnan(x)) return 0;
  if (above == curve.end()) return static_cast<uint8_t>(image::Response::codes - 1);
  const auto below = above - 1;
  return static_cast<uint8_t>((x - *below <= *above - x ? below : above) - curve.begin());
}

double sensed(double x, const StageExposure& camera, Random& random) {
  if (!(camera.fullWell > 0)) return x;
  const double full = camera.response.exposure[0].back();
  const double electrons = camera.fullWell * std::max(0.0, x) / full;
  const double variance = electrons + camera.readNoise * camera.readNoise;
  return (electrons + std::sqrt(variance) * normal(random)) * full / camera.fullWell;
}

image::Image exposed(const image::Image& radiance, const image::Image& alpha, const StageExposure& camera,
                     const BracketShot& shot) {
  image::Image picture(alpha.width, alpha.height, 4);
  Random random{shot.seed, shot.view, shot.light, shot.shot};
  for (size_t pixel = 0; pixel < alpha.values.size(); ++pixel) {
    for (size_t c = 0; c < 3; ++c) {
      const double x = camera.seconds[shot.shot] * static_cast<double>(radiance.values[3 * pixel + c]);
      const uint8_t code = codeOf(camera.response, static_cast<float>(sensed(x, camera, random)));
      picture.values[4 * pixel + c] = static_cast<float>(code) / 255;
    }
    picture.values[4 * pixel + 3] = alpha.values[pixel];
  }
  return picture;
}

} // namespace surflect::stage
