#include "bench/doll/studio.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace surflect::bench {
namespace {

TEST(Studio, TheWarmLampIsTheBrightest) {
  const ulr::EnvironmentMap studio = studioLight();
  const auto brightest = std::ranges::max_element(studio.texels, {}, [](const ulr::EnvironmentLight& texel) {
    return texel.irradiance.r + texel.irradiance.g + texel.irradiance.b;
  });
  EXPECT_GT(brightest->irradiance.r, brightest->irradiance.b);
  EXPECT_GT(brightest->towards.raw().cast<double>().dot(Vec3<double>(1, 0.8, 0.6).normalized()), 0.999);
}

TEST(Studio, LightComesFromEverywhereButMostOfItFromTheLamps) {
  const ulr::EnvironmentMap studio = studioLight();
  EXPECT_EQ(studio.replaced, 0u);
  EXPECT_EQ(studio.texels.size(), 256u * 128u);
  const Rgb all = ulr::totalIrradiance(studio.texels);
  std::vector<ulr::EnvironmentLight> lamps;
  for (const Vec3<double>& towards : {Vec3<double>(1, 0.8, 0.6), Vec3<double>(-1, 0.5, 0.8)})
    for (const ulr::EnvironmentLight& texel : studio.texels)
      if (texel.towards.raw().cast<double>().dot(towards.normalized()) > std::cos(0.3))
        lamps.push_back(texel);
  EXPECT_GT(ulr::totalIrradiance(lamps).g, 0.9f * all.g);
}

} // namespace
} // namespace surflect::bench
