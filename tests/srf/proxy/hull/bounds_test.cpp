#include "srf/proxy/hull/bounds.h"

#include "tests/srf/proxy/hull/shapes.h"

namespace surflect::hull {
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
    const auto silhouetteViews = shapes::silhouetteViews(cameras, object);
    const auto truth = boxOf(object), box = boundsOf(silhouetteViews, quorumOf(silhouetteViews), false, {}),
               lenient = boundsOf(silhouetteViews, quorumOf(silhouetteViews), true, {});
    EXPECT_TRUE(box.contains(truth));
    EXPECT_TRUE(lenient.contains(truth));
    EXPECT_LT(box.sizes().maxCoeff(), 1.5 * truth.sizes().maxCoeff());
    EXPECT_LT(lenient.sizes().maxCoeff(), 2.2 * truth.sizes().maxCoeff());
    EXPECT_LT(truth.exteriorDistance(pointInView(silhouetteViews).raw()), 0.1);
  }
}

TEST(Bounds, FindASmallObjectFarAside) {
  auto cameras = shapes::camerasAround(12, 400);
  for (auto& camera : cameras) camera.lens.focalX = camera.lens.focalY = 300;
  const std::vector<shapes::Sphere> object{{{1.1, -0.9, 0.8}, 0.03}};
  const auto silhouetteViews = shapes::silhouetteViews(cameras, object);
  const auto box = boundsOf(silhouetteViews, quorumOf(silhouetteViews), false, {});
  EXPECT_TRUE(box.contains(boxOf(object)));
  EXPECT_LT(box.sizes().maxCoeff(), 0.12);
}

TEST(Bounds, WithDissentOutliveAnEmptyMatte) {
  auto silhouetteViews = shapes::silhouetteViews(shapes::camerasAround(8, 60), shapes::sphere());
  silhouetteViews[3].outline = Outline(image::Image(60, 60, 1));
  EXPECT_TRUE(boundsOf(silhouetteViews, quorumOf(silhouetteViews), false, {}).isEmpty());
  EXPECT_TRUE(
      boundsOf(silhouetteViews, quorumOf(silhouetteViews), true, {}).contains(boxOf(shapes::sphere())));
}

// A matte of which the columns (rows) from `first` up to `end` are inside, but for a border of 5 pixels.
image::Image stripe(int size, int first, int end, bool rows) {
  image::Image alpha(size, size, 1);
  for (int across = first; across < end; ++across)
    for (int along = 5; along < size - 5; ++along)
      alpha.at(rows ? along : across, rows ? across : along)[0] = 1;
  return alpha;
}

// Along each axis one view sees the object on one side of the middle, one on the other. An outline counts as
// exact to a pixel, so these two, two pixels apart, may touch; or overlap by less than anyone sees.
TEST(Bounds, OfSilhouettesThatTouchInAPointAreEmpty) {
  constexpr int kSize = 60;
  const auto z = shapes::orthographic(studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, kSize)),
             x = shapes::orthographic(studio::cameraFrom<AcquisitionSpace>({1, 0, 0}, kSize));
  for (const double overlap : {0., 1e-10, 2.}) { // pixels
    std::vector<SilhouetteView> silhouetteViews;
    for (auto [camera, rows] : {std::pair{z, false}, {z, true}, {x, false}}) {
      silhouetteViews.push_back(
          shapes::sightOf(camera, stripe(kSize, 5, kSize / 2 - 1, rows), silhouetteViews.size()));
      (rows ? camera.lens.centerY : camera.lens.centerX) += overlap;
      silhouetteViews.push_back(
          shapes::sightOf(camera, stripe(kSize, kSize / 2 + 1, kSize - 5, rows), silhouetteViews.size()));
    }
    EXPECT_EQ(boundsOf(silhouetteViews, silhouetteViews.size(), false, {}).isEmpty(), overlap < 1) << overlap;
  }
}

} // namespace
} // namespace surflect::hull
