#include "tests/stability/entry.h"

#include "srf/image/exr.h"
#include "srf/weights/environment_map.h"
#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace surflect::stability {
namespace {

using weights::EnvironmentMapping;

constexpr int kWidth = 64, kHeight = 32;

image::Image constantMap(float radiance) {
  image::Image map(kWidth, kHeight, 3);
  std::ranges::fill(map.values, radiance);
  return map;
}

// Irradiance of a surface that faces a direction, red. Naive: every texel has an equal share of the sphere,
// and its samples are taken as they are.
Measured irradianceErrors(const image::Image& map, const Vec3<double>& normal, double truth) {
  const double share = 4 * std::numbers::pi / (map.width * map.height);
  double naive = 0, ours = 0;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const auto d = weights::latLongDirection((x + 0.5) / map.width, (y + 0.5) / map.height);
      const double cosine = d.raw().dot(normal);
      if (cosine > 0) naive += share * double{map.at(x, y)[0]} * cosine;
    }
  auto lights = weights::environmentOf(map, EnvironmentMapping::latLong).lights;
  for (const auto& light : weights::clusteredLights(std::move(lights), 1e-3))
    ours += double{light.irradiance.r} * std::max(0.0, light.towards.raw().cast<double>().dot(normal));
  return {std::abs(naive / truth - 1), std::abs(ours / truth - 1)};
}

// Lights that are negative or not finite.
Measured wrongLights(float sample) {
  image::Image map = constantMap(1);
  std::ranges::copy(std::array{sample, sample, sample}, map.at(20, 10).begin());
  Measured count;
  for (const float value : map.values) count.naive += !(value >= 0 && std::isfinite(value));
  for (const auto& light : weights::environmentOf(map, EnvironmentMapping::latLong).lights)
    for (const float value : {light.irradiance.r, light.irradiance.g, light.irradiance.b})
      count.ours += !(value >= 0 && std::isfinite(value));
  return count;
}

Measured refusal(int width, int height) {
  const image::TemporaryFolder folder;
  image::writeExr(folder / "map.exr", image::Image(width, height, 3), image::Precision::single);
  try {
    weights::readEnvironment(folder / "map.exr");
  } catch (const Error&) {
    return {1, 0};
  }
  return {1, 1};
}

} // namespace

Group environmentGroup() {
  return {"Environment maps",
          "texels as lights with equal shares of the sphere, their samples as they are",
          {
              {"constant map of radiance 1", "irradiance pi", "relative error, facing the pole", 0.003,
               [] {
                 return irradianceErrors(constantMap(1), {0, 1, 0}, std::numbers::pi);
               }},
              {"constant map of radiance 1", "irradiance pi", "relative error, facing the horizon", 0.003,
               [] {
                 return irradianceErrors(constantMap(1), {0, 0, -1}, std::numbers::pi);
               }},
              {"one bright texel near the pole in a black map", "radiance times its solid angle",
               "relative error", 1e-4,
               [] {
                 image::Image map = constantMap(0);
                 map.at(10, 1)[0] = 1e4f;
                 const auto d = weights::latLongDirection(10.5 / kWidth, 1.5 / kHeight);
                 const double top = std::cos(std::numbers::pi / kHeight),
                              bottom = std::cos(2 * std::numbers::pi / kHeight);
                 return irradianceErrors(map, d.raw(), 1e4 * 2 * std::numbers::pi / kWidth * (top - bottom));
               }},
              {"a negative texel", "0, counted", "wrong values of lights", 0, [] { return wrongLights(-2); }},
              {"a texel that is not a number", "0, counted", "wrong values of lights", 0,
               [] { return wrongLights(std::numeric_limits<float>::quiet_NaN()); }},
              {"an infinite texel", "65504, counted", "wrong values of lights", 0,
               [] { return wrongLights(std::numeric_limits<float>::infinity()); }},
              {"a map of 9 x 3", "refused by name", "maps taken", 0, [] { return refusal(9, 3); }},
              {"a cube cross of 6 x 8", "refused by name", "maps taken", 0, [] { return refusal(6, 8); }},
          }};
}

} // namespace surflect::stability
