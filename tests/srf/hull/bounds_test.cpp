#include "srf/hull/bounds.h"

#include "tests/srf/hull/shapes.h"

namespace surflect {
namespace {

using shapes::Point;

Eigen::AlignedBox3d boxOf(const std::vector<shapes::Sphere>& spheres) {
  Eigen::AlignedBox3d box;
  for (const auto& s : spheres) {
    box.extend(Vec3<double>(s.center.array() - s.radius));
    box.extend(Vec3<double>(s.center.array() + s.radius));
  }
  return box;
}

TEST(Bounds, HoldTheObjectAndLittleElse) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const auto object = shapes::randomCluster(seed);
    auto cameras = shapes::camerasAround(12, 60);
    if (seed % 2)
      for (auto& camera : cameras) camera = shapes::orthographic(camera);
    const auto sights = shapes::sights(cameras, object);
    const auto truth = boxOf(object), box = boundsOf(sights, quorumOf(sights), false, {}),
               lenient = boundsOf(sights, quorumOf(sights), true, {});
    EXPECT_TRUE(box.contains(truth));
    EXPECT_TRUE(lenient.contains(truth));
    EXPECT_LT(box.sizes().maxCoeff(), 1.5 * truth.sizes().maxCoeff());
    EXPECT_LT(lenient.sizes().maxCoeff(), 2.2 * truth.sizes().maxCoeff());
    EXPECT_LT(truth.exteriorDistance(pointInView(sights).raw()), 0.1);
  }
}

TEST(Bounds, FindASmallObjectFarAside) {
  auto cameras = shapes::camerasAround(12, 400);
  for (auto& camera : cameras) camera.lens.focalX = camera.lens.focalY = 300;
  const std::vector<shapes::Sphere> object{{{1.1, -0.9, 0.8}, 0.03}};
  const auto sights = shapes::sights(cameras, object);
  const auto box = boundsOf(sights, quorumOf(sights), false, {});
  EXPECT_TRUE(box.contains(boxOf(object)));
  EXPECT_LT(box.sizes().maxCoeff(), 0.12);
}

TEST(Bounds, WithDissentOutliveAnEmptyMatte) {
  auto sights = shapes::sights(shapes::camerasAround(8, 60), shapes::sphere());
  sights[3].outline = Outline(Image(60, 60, 1));
  EXPECT_TRUE(boundsOf(sights, quorumOf(sights), false, {}).isEmpty());
  EXPECT_TRUE(boundsOf(sights, quorumOf(sights), true, {}).contains(boxOf(shapes::sphere())));
}

} // namespace
} // namespace surflect
