#include "bench/doll/studio.h"

#include <cmath>

namespace surflect::bench {

namespace {

// 1 in its middle, half of it 4 degrees away.
double lamp(const Vec3<double>& direction, const Vec3<double>& towards) {
  return std::exp(300 * (direction.dot(towards.normalized()) - 1));
}

} // namespace

ulr::EnvironmentMap studioLight() {
  const Vec3<double> warm(1, 0.85, 0.7), cold(0.8, 0.9, 1);
  constexpr int kHeight = 128;
  image::Image image(2 * kHeight, kHeight, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Vec3<double> d = ulr::latLongDirection((x + 0.5) / image.width, (y + 0.5) / image.height).raw();
      const Vec3<double> room = (0.02 + 0.01 * d[1]) * Vec3<double>::Ones();
      const Vec3<double> radiance =
          room + 180 * lamp(d, {1, 0.8, 0.6}) * warm + 72 * lamp(d, {-1, 0.5, 0.8}) * cold;
      for (size_t c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(radiance[static_cast<int>(c)]);
    }
  return ulr::environmentOf(image, ulr::EnvironmentMapping::latLong);
}

} // namespace surflect::bench
