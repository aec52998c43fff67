#include "render/scene/scene.h"

#include "srf/image/exr.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <limits>

namespace surflect::scene {
namespace {

TEST(Environments, ReadingTellsWhatTheMapHolds) {
  image::Image image(32, 16, 3);
  std::ranges::fill(image.values, 1.f);
  image.at(3, 4)[1] = -2;
  std::ranges::fill(image.at(9, 9), std::numeric_limits<float>::quiet_NaN());
  image::TemporaryFolder folder;
  image::writeExr(folder / "map.exr", image, image::Precision::single);
  const auto read = [&] {
    return readEnvironments(parseScript("[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\n[[light]]\n"
                                        "type = \"environment\"\nimage = \"map.exr\"\n",
                                        folder / "shot.toml"),
                            {});
  };
  const auto environments = read();
  ASSERT_EQ(environments.size(), 1u);
  EXPECT_EQ(environments[0].image, folder / "map.exr");
  EXPECT_EQ(environments[0].map->lights.size(), 16 * (32u * 16 - 1)) << "parts of texels";
  EXPECT_EQ(environments[0].map->replaced, 2u);
  EXPECT_EQ(environments[0].hash, read()[0].hash);
  image.at(3, 4)[1] = 2;
  image::writeExr(folder / "map.exr", image, image::Precision::single);
  EXPECT_NE(environments[0].hash, read()[0].hash);
}

} // namespace
} // namespace surflect::scene
