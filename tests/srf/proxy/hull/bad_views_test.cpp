#include "srf/proxy/hull/bad_views.h"

#include "srf/proxy/hull/bounds.h"
#include "tests/srf/proxy/hull/shapes.h"

namespace surflect::hull {
namespace {

std::vector<size_t> found(const std::vector<SilhouetteView>& silhouetteViews) {
  return badViews(silhouetteViews, quorumOf(silhouetteViews),
                  boundsOf(silhouetteViews, quorumOf(silhouetteViews), true, {}), {});
}

TEST(BadViews, ConsistentMattesAreNeverBad) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    auto cameras = shapes::camerasAround(5 + 6 * static_cast<int>(seed), 80);
    if (seed % 3 == 1)
      for (auto& camera : cameras) camera = shapes::orthographic(camera);
    if (seed % 3 == 2) // some crop
      for (size_t i = 0; i < cameras.size(); i += 2) cameras[i].lens.focalX = cameras[i].lens.focalY = 250;
    EXPECT_EQ(found(shapes::silhouetteViews(cameras, shapes::randomCluster(seed))), std::vector<size_t>{})
        << seed;
    EXPECT_EQ(found(shapes::silhouetteViews(cameras, shapes::ring())), std::vector<size_t>{}) << seed;
  }
}

TEST(BadViews, MissingPartsAreFound) {
  const auto cameras = shapes::camerasAround(16, 80);
  auto arm = shapes::sphere();
  arm[0].radius = 0.6;
  const auto body = arm;
  for (int i = 0; i < 5; ++i) arm.push_back({{0, 0.55 + 0.08 * i, 0}, 0.08});
  auto silhouetteViews = shapes::silhouetteViews(cameras, arm);
  silhouetteViews[7] = shapes::sightOf(cameras[7], shapes::matte(cameras[7], body), 7);
  EXPECT_EQ(found(silhouetteViews), std::vector<size_t>{7});
  silhouetteViews[8] = shapes::sightOf(cameras[8], shapes::matte(cameras[8], body), 8);
  EXPECT_EQ(found(silhouetteViews), (std::vector<size_t>{7, 8}));
}

TEST(BadViews, EmptyMattesAreFoundAndFullOnesAreHarmless) {
  const auto cameras = shapes::camerasAround(16, 80);
  auto silhouetteViews = shapes::silhouetteViews(cameras, shapes::twoLobes());
  image::Image full(80, 80, 1);
  std::ranges::fill(full.values, 1.f);
  silhouetteViews[4] = shapes::sightOf(cameras[4], full, 4);
  silhouetteViews[2] = shapes::sightOf(cameras[2], image::Image(80, 80, 1), 2);
  silhouetteViews[11] = shapes::sightOf(cameras[11], image::Image(80, 80, 1), 11);
  EXPECT_EQ(found(silhouetteViews), (std::vector<size_t>{2, 11}));
}

TEST(BadViews, NoMoreThanAQuarterIsFound) {
  const auto cameras = shapes::camerasAround(12, 60);
  auto silhouetteViews = shapes::silhouetteViews(cameras, shapes::sphere());
  std::mt19937 random(9);
  for (size_t i = 0; i < 6; ++i) { // half of them cut away a half
    image::Image alpha = shapes::matte(cameras[i], shapes::sphere());
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 60; ++x)
        if ((i % 2 ? x : y) < 30) alpha.at(x, y)[0] = 0;
    silhouetteViews[i] = shapes::sightOf(cameras[i], alpha, i);
  }
  EXPECT_LE(found(silhouetteViews).size(), 3u);
}

} // namespace
} // namespace surflect::hull
