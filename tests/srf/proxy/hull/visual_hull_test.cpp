#include "srf/proxy/hull/visual_hull.h"

#include "srf/capture/silhouette.h"
#include "srf/image/mask.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/srf/proxy/hull/shapes.h"

#include <tbb/global_control.h>

namespace surflect::hull {
namespace {

using shapes::Point;

VisualHull hullOf(const std::vector<SilhouetteView>& silhouetteViews, double voxelPixels = 1.5) {
  return visualHull(silhouetteViews, {voxelPixels}, {});
}

double worstFit(const TriangleMesh& mesh, const std::vector<SilhouetteView>& silhouetteViews) {
  const RayCaster<AcquisitionSpace> caster(mesh);
  double worst = 1;
  for (const SilhouetteView& silhouetteView : silhouetteViews)
    worst = std::min(worst, image::intersectionOverUnion(
                                image::objectMask(capture::silhouette(silhouetteView.camera, caster)),
                                silhouetteView.outline.mask()));
  return worst;
}

// Distance of a point from the exact hull of the unit sphere at the origin; negative inside.
double beyondSphereHull(const std::vector<capture::Camera<AcquisitionSpace>>& cameras,
                        const Vec3<double>& p) {
  double farthest = 0;
  for (const auto& camera : cameras) {
    const Vec3<double> d = capture::Viewpoint(camera).towards(assume<Point>(p)).raw();
    farthest = std::max(farthest, (p - p.dot(d) * d).norm());
  }
  return farthest - 1;
}

TEST(VisualHull, OfASphereConvergesToTheIntersectionOfItsCones) {
  double bound = 0.02;
  for (const int size : {50, 100}) {
    const auto cameras = shapes::camerasAround(14, size);
    const auto silhouetteViews = shapes::silhouetteViews(cameras, shapes::sphere());
    const VisualHull hull = hullOf(silhouetteViews);
    shapes::expectClosedManifold(hull.mesh);
    EXPECT_EQ(shapes::eulerCharacteristic(hull.mesh), 2);
    EXPECT_GT(worstFit(hull.mesh, silhouetteViews), 0.98);
    EXPECT_TRUE(hull.leftOut.empty());
    double sum = 0;
    for (const auto& p : hull.mesh.positions) {
      const Vec3<double> at = p.cast<double>().raw();
      EXPECT_GT(at.norm(), 1 - 0.2 * hull.voxel) << "cuts into the object";
      sum += std::pow(beyondSphereHull(cameras, at), 2);
    }
    const double rms = std::sqrt(sum / static_cast<double>(hull.mesh.positions.size()));
    EXPECT_LT(rms, bound);
    bound = rms / 1.8;
  }
}

TEST(VisualHull, KeepsAHoleAndAWaist) {
  const auto cameras = shapes::camerasAround(20, 100);
  const VisualHull ring = hullOf(shapes::silhouetteViews(cameras, shapes::ring()));
  shapes::expectClosedManifold(ring.mesh);
  EXPECT_EQ(shapes::eulerCharacteristic(ring.mesh), 0);
  const auto silhouetteViews = shapes::silhouetteViews(cameras, shapes::twoLobes());
  const VisualHull lobes = hullOf(silhouetteViews);
  shapes::expectClosedManifold(lobes.mesh);
  EXPECT_EQ(shapes::eulerCharacteristic(lobes.mesh), 2);
  EXPECT_GT(worstFit(lobes.mesh, silhouetteViews), 0.97);
}

TEST(VisualHull, IsTheSameForAnyNumberOfThreads) {
  const auto silhouetteViews =
      shapes::silhouetteViews(shapes::camerasAround(9, 60), shapes::randomCluster(10));
  const VisualHull a = hullOf(silhouetteViews);
  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  const VisualHull b = hullOf(silhouetteViews);
  EXPECT_EQ(a.mesh.positions, b.mesh.positions);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
}

TEST(VisualHull, MovesWithTheCameras) {
  const auto cameras = shapes::camerasAround(12, 80);
  const auto object = shapes::randomCluster(11);
  const auto still = shapes::silhouetteViews(cameras, object);
  const Rigid<AcquisitionSpace, AcquisitionSpace> motion(
      Eigen::AngleAxisd(1.1, Vec3<double>(1, 2, -1).normalized()).toRotationMatrix(),
      Vec3<double>(30, -4, 11));
  auto moved = still;
  for (SilhouetteView& silhouetteView : moved)
    silhouetteView.camera.cameraFromWorld = silhouetteView.camera.cameraFromWorld * motion.inverse();
  const VisualHull a = hullOf(still), b = hullOf(moved);
  EXPECT_NEAR(b.voxel / a.voxel, 1, 0.03);
  EXPECT_NEAR(shapes::volume(b.mesh) / shapes::volume(a.mesh), 1, 0.01);
  for (const auto& p : b.mesh.positions) {
    const double distance =
        hullDistance(still, quorumOf(still), motion.inverse()(p.cast<double>()), 4 * a.voxel);
    EXPECT_LT(std::abs(distance), a.voxel);
  }
}

TEST(VisualHull, OfOrthographicAndDistortedViews) {
  auto cameras = shapes::camerasAround(16, 80);
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (i % 3 == 0) cameras[i] = shapes::orthographic(cameras[i]);
    if (i % 3 == 1) cameras[i].lens.k1 = -0.3, cameras[i].lens.p2 = 0.01;
  }
  const auto object = shapes::randomCluster(12);
  const auto silhouetteViews = shapes::silhouetteViews(cameras, object);
  const VisualHull hull = hullOf(silhouetteViews);
  shapes::expectClosedManifold(hull.mesh);
  EXPECT_GT(worstFit(hull.mesh, silhouetteViews), 0.95);
}

TEST(VisualHull, ViewsThatCropDoNotCarve) {
  auto cameras = shapes::camerasAround(20, 80);
  for (size_t i = 0; i < cameras.size(); i += 2) {
    cameras[i].lens.focalX = cameras[i].lens.focalY = 500; // the sphere is 3.2 times as wide as the picture
    cameras[i].lens.centerX += 100;                        // and its left edge is in it
  }
  const VisualHull hull = hullOf(shapes::silhouetteViews(cameras, shapes::sphere()));
  shapes::expectClosedManifold(hull.mesh);
  EXPECT_TRUE(hull.leftOut.empty());
  for (const auto& p : hull.mesh.positions) EXPECT_GT(p.raw().norm(), 1 - 0.3 * hull.voxel);
  EXPECT_LT(shapes::volume(hull.mesh), 4 * std::numbers::pi / 3 * 1.15);
}

// Its matte says little from there, but nothing wrong.
TEST(VisualHull, OneCameraAtAnotherScaleHardlyChangesIt) {
  const auto cameras = shapes::camerasAround(9, 80);
  const auto object = shapes::randomCluster(15);
  auto silhouetteViews = shapes::silhouetteViews(cameras, object);
  const VisualHull right = hullOf(silhouetteViews);
  for (const double scale : {100., 10'000., 1e6}) {
    auto& pose = silhouetteViews[0].camera.cameraFromWorld;
    pose = {cameras[0].cameraFromWorld.rotation(), scale * cameras[0].cameraFromWorld.translation()};
    const VisualHull hull = hullOf(silhouetteViews);
    shapes::expectClosedManifold(hull.mesh);
    EXPECT_GT(worstFit(hull.mesh, {silhouetteViews.begin() + 1, silhouetteViews.end()}), 0.95) << scale;
    EXPECT_NEAR(shapes::volume(hull.mesh) / shapes::volume(right.mesh), 1, 0.2) << scale;
  }
}

TEST(VisualHull, BadMattesHardlyChangeIt) {
  const auto cameras = shapes::camerasAround(16, 80);
  const auto object = shapes::randomCluster(13);
  const auto good = shapes::silhouetteViews(cameras, object);
  const double volume = shapes::volume(hullOf(good).mesh);

  auto bad = good;
  bad[2].outline = Outline(image::Image(80, 80, 1));
  image::Image full(80, 80, 1);
  std::ranges::fill(full.values, 1.f);
  bad[6].outline = Outline(full);
  image::Image bitten = shapes::matte(cameras[9], object);
  const capture::Pixel middle = good[9].outline.centroid();
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 80; ++x)
      if (x > middle.x) bitten.at(x, y)[0] = 0;
  bad[9].outline = Outline(bitten);
  const VisualHull hull = hullOf(bad);
  EXPECT_EQ(hull.leftOut, (std::vector<size_t>{2, 9}));
  shapes::expectClosedManifold(hull.mesh);
  EXPECT_NEAR(shapes::volume(hull.mesh) / volume, 1, 0.05);

  // Exactly the hull of those that are left.
  auto rest = bad;
  rest.erase(rest.begin() + 9), rest.erase(rest.begin() + 2);
  EXPECT_EQ(hullOf(rest).mesh.positions, hull.mesh.positions);
}

TEST(VisualHull, CannotBeMadeOfOneViewOrOfSilhouettesApart) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (int axis = 0; axis < 3; ++axis)
    cameras.push_back(studio::cameraFrom<AcquisitionSpace>(Vec3<double>::Unit(axis), 60));
  auto silhouetteViews = shapes::silhouetteViews(cameras, shapes::sphere());
  EXPECT_EQ(image::errorOf([&] { hullOf({silhouetteViews[0]}); }),
            "found 1, expected silhouettes of two views or more");
  // Two views see a ball here, the third sees one elsewhere.
  for (const auto& [offset, radius] : {std::pair{0.5, 0.2}, {0.11, 0.1}}) { // far apart, and by a pixel
    for (size_t i = 0; i < 3; ++i)
      silhouetteViews[i] = shapes::sightOf(
          cameras[i],
          shapes::matte(cameras[i], {{Vec3<double>::Constant(i == 1 ? -offset : offset), radius}}), i);
    EXPECT_EQ(
        image::errorOf([&] { hullOf(silhouetteViews); }),
        "the silhouettes of the 3 views have no point in common; where most of them agree, these do not: "
        "C1 (poses are camera to world, by OpenGL's axes: surflect inspect tells more)");
  }
}

TEST(VisualHull, StopsWhenAsked) {
  const auto silhouetteViews = shapes::silhouetteViews(shapes::camerasAround(6, 40), shapes::sphere());
  for (const double moment : {0.0, 0.2, 0.8}) {
    Progress progress;
    bool stop = false;
    progress.report = [&](std::string_view, double fraction) { stop |= fraction >= moment; };
    progress.cancelled = [&] { return stop; };
    EXPECT_THROW(visualHull(silhouetteViews, {}, progress), Cancelled);
  }
}

} // namespace
} // namespace surflect::hull
