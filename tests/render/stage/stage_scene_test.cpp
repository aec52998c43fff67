#include "render/stage/stage_scene.h"
#include "tests/render/stage/stages.h"

#include <gtest/gtest.h>

namespace surflect::stage {
namespace {

// A ray's result depends neither on the other rays nor on the beam hint.
TEST(StageScene, RaysTogetherMeetWhatTheyMeetAlone) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2), distances(0.1, 3);
  std::uniform_int_distribution<size_t> counts(0, kMostRays);
  std::vector<StageObject> objects = oneObject(bumpySphere({5, 0, 0}, 0.9, 0.3, 6, 48), material::Lambert{});
  objects.push_back({box({5.9, 0.4, 0.3}, {0.3, 0.6, 0.5}, 1), material::Lambert{}});
  const StageScene scene(objects);
  int met = 0, all = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const size_t count = counts(random);
    const StageDirection common = randomDirection(random);
    std::vector<ShadowRay> rays;
    std::vector<bool> isMet;
    for (size_t i = 0; i < count; ++i) {
      const StagePoint origin(5 + uniform(random), uniform(random), uniform(random));
      const StageDirection direction = trial % 2 ? common : randomDirection(random);
      const double distance = distances(random);
      rays.push_back(scene.shadowRay(origin, direction, distance));
      const auto hit = scene.firstHit(origin, direction);
      isMet.push_back(hit && hit->distance < distance);
    }
    for (const Beam beam : {Beam::narrow, Beam::wide}) {
      const uint32_t occluded = scene.occluded(rays, beam);
      EXPECT_EQ(occluded >> rays.size(), 0u);
      for (size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(occluded >> i & 1, isMet[i]) << trial << ' ' << i;
        met += isMet[i];
        ++all;
      }
    }
  }
  EXPECT_GT(met, all / 10);
  EXPECT_LT(met, all * 9 / 10);
}

// On the triangle, at the distance from the origin; and a ray that leaves does not meet the same triangle.
TEST(StageScene, HitsLieOnTheirRays) {
  std::mt19937 random(2);
  const StageScene scene(oneObject(sphere({3, 0, 0}, 1, 64), material::Lambert{}));
  for (int trial = 0; trial < 500; ++trial) {
    const StageDirection in = randomDirection(random), out = randomDirection(random);
    const auto hit = scene.firstHit({3, 0, 0}, in);
    ASSERT_TRUE(hit);
    EXPECT_LT((hit->position.raw() - (Vec3<double>(3, 0, 0) + hit->distance * in.raw())).norm(), 1e-5);
    const StageDirection away = dot(out, hit->facet) < 0 ? -out : out;
    EXPECT_FALSE(scene.firstHit(scene.leaving(*hit, away), away)) << trial;
  }
}

} // namespace
} // namespace surflect::stage
