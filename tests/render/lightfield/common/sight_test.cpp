#include "render/lightfield/common/sight.h"

#include "srf/weights/fades.h"
#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

namespace surflect::lightfield {

namespace {

// A capture of boxes with its photographs in memory.
struct Scene {
  image::TemporaryFolder folder;
  Views views;
  Photographs photographs;
  SmoothNormals normals;
  Sight sight;

  Scene(const TriangleMesh& mesh, const boxes::RadianceAt& radianceAt, const boxes::Shoot& shoot)
      : views((boxes::writeCapture(mesh, radianceAt, shoot, folder.path()), folder.path())),
        photographs(views), normals(views.mesh()), sight(photographs, views.rays()) {}

  // Points spread over all triangles, away from their edges by a share of their size.
  std::vector<SurfacePoint> points(size_t perTriangle, double margin) const {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<SurfacePoint> points;
    const TriangleMesh& mesh = views.mesh();
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
      for (size_t n = 0; n < perTriangle; ++n) {
        const double b = share(random), c = share(random) * (1 - b);
        Vec3<double> weights(1 - b - c, b, c);
        weights = (1 - 3 * margin) * weights + Vec3<double>::Constant(margin);
        Vec3<double> place = Vec3<double>::Zero();
        for (size_t corner = 0; corner < 3; ++corner)
          place += weights[static_cast<Eigen::Index>(corner)] *
                   mesh.positions[mesh.triangles[t][corner]].raw().cast<double>();
        points.push_back(surfacePoint(mesh, normals, t, assume<Point3<AcquisitionSpace, double>>(place)));
      }
    return points;
  }
};

Rgb colorOf(const Vec3<double>& place, const Vec3<double>& towards) {
  return {static_cast<float>(2 + place[0]), static_cast<float>(1 + towards[1] / 2),
          static_cast<float>(place[2] + 1)};
}

// A bright plate above a dark table, photographed from straight above and from the side.
Scene plateAboveTable() {
  TriangleMesh mesh;
  boxes::addBox(mesh, {-0.8f, -0.8f, -0.2f}, {0.8f, 0.8f, -0.1f});
  boxes::addBox(mesh, {-0.3f, -0.3f, 0.2f}, {0.3f, 0.3f, 0.3f});
  const auto radiance = [](const Vec3<double>& place, const Vec3<double>&) {
    return place[2] > 0 ? Rgb{100, 100, 100} : Rgb{1, 1, 1};
  };
  return {mesh, radiance, {{{0, 0, 1}, {1, 0, 0.4}}, 128, 0.35}};
}

TEST(Sight, AFaceOfAConvexBodyIsSeenByTheCamerasInFrontOfIt) {
  const Scene scene(boxes::unitCube(), colorOf, {studio::spiral(24), 96, 0.3});
  for (const SurfacePoint& point : scene.points(20, 0.1)) {
    std::set<uint32_t> expected, found;
    for (uint32_t p = 0; p < scene.photographs.size(); ++p)
      if (scene.sight.towards(p, point.position).raw().dot(point.face) > 0.3) expected.insert(p);
    for (const Observation& o : scene.sight.observations(point)) {
      found.insert(o.photograph);
      EXPECT_GT(o.towards.raw().cast<double>().dot(point.face), kGrazing);
      EXPECT_GT(o.fade, 0);
      EXPECT_LE(o.fade, 1);
    }
    EXPECT_TRUE(std::ranges::includes(found, expected));
  }
}

TEST(Sight, ShowsTheRadianceThatLeftThePlaceTowardsTheCamera) {
  const Scene scene(boxes::unitCube(), colorOf, {studio::spiral(24), 128, 0.3});
  for (const SurfacePoint& point : scene.points(20, 0.1))
    for (const Observation& o : scene.sight.observations(point)) {
      const auto towards = normalized(scene.photographs.camera(o.photograph).center() - point.position);
      EXPECT_NEAR((towards.cast<float>().raw() - o.towards.raw()).norm(), 0, 1e-6);
      const Rgb color = colorOf(point.position.raw(), towards.raw());
      // Half floats of about 2, and bilinear interpolation of places that are seen at up to 85 degrees.
      EXPECT_NEAR(o.radiance[0], color.r, 8e-3);
      EXPECT_NEAR(o.radiance[1], color.g, 8e-3);
      EXPECT_NEAR(o.radiance[2], color.b, 8e-3);
    }
}

TEST(Sight, AnOccluderHidesWhatLiesBehindItAndFadesWhatIsBesideIt) {
  const Scene scene = plateAboveTable();
  const double focal = scene.photographs.camera(0).lens.focalX;
  size_t hidden = 0, faded = 0, clear = 0;
  for (const SurfacePoint& point : scene.points(2000, 0.03)) {
    const Vec3<double> p = point.position.raw();
    if (std::abs(p[2] + 0.1) > 1e-6) continue;
    for (const Observation& o : scene.sight.observations(point))
      EXPECT_NEAR(o.radiance[0], 1, 1e-3) << "the plate must not show on the table";
    if (p.head<2>().cwiseAbs().maxCoeff() > 0.65) continue; // fades towards the table's own edge
    // Pixels from the outline of the plate, whose upper face is 3.7 from the camera; below 0 within it.
    const Vec3<double> outside =
        focal * (p.cwiseAbs() / 4.1 - Vec3<double>::Constant(0.3 / 3.7)).cwiseProduct(Vec3<double>(1, 1, 0));
    const double distance = outside.head<2>().maxCoeff() <= 0 ? outside.head<2>().maxCoeff()
                                                              : outside.head<2>().cwiseMax(0).norm();
    const auto seen = scene.sight.observe(0, point);
    if (distance <= 0) {
      EXPECT_FALSE(seen);
      ++hidden;
    } else {
      const double fade = seen ? static_cast<double>(seen->fade) : 0;
      // The first pixels that show the table alone are up to a pixel and a half from the outline.
      EXPECT_LE(fade, weights::smoothStep(0, 3, distance + 1) + 1e-6);
      EXPECT_GE(fade, distance < 1.6 ? 0 : weights::smoothStep(0, 3, distance - 0.6) - 1e-6);
      ++(fade < 0.9 ? faded : clear);
    }
  }
  EXPECT_GT(hidden, 200u);
  EXPECT_GT(faded, 100u);
  EXPECT_GT(clear, 200u);
}

TEST(Sight, PlacesOutsideThePictureAreNotSeen) {
  const Scene scene(boxes::unitCube(), colorOf, {{{0, 0, 1}}, 64, 0.08}); // shows the middle of a face only
  for (const SurfacePoint& point : scene.points(100, 0)) {
    const Vec3<double> p = point.position.raw();
    const double reach = std::max(std::abs(p[0]), std::abs(p[1]));
    if (p[2] < 0.499 || reach > 3.5 * std::tan(0.08)) {
      EXPECT_FALSE(scene.sight.observe(0, point));
    } else if (reach < 0.2) {
      EXPECT_TRUE(scene.sight.observe(0, point));
    }
  }
}

} // namespace

namespace {

TEST(PixelFootprint, IsDistanceOverFocalLengthInFrontOfAFace) {
  const auto camera = studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, 100); // at distance 4
  TriangleMesh square{{{-0.01f, -0.01f, 1}, {0.01f, -0.01f, 1}, {0.01f, 0.01f, 1}}, {{0, 1, 2}}};
  EXPECT_NEAR(pixelFootprint(square, std::vector{camera}), 3 / camera.lens.focalX, 1e-5 * 3);
}

TEST(PixelFootprint, OfAnOrthographicCameraIsItsScale) {
  auto camera = studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, 100);
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.lens.focalX = camera.lens.focalY = 20;
  EXPECT_DOUBLE_EQ(pixelFootprint(boxes::unitCube(), std::vector{camera}), 1 / 20.0);
}

TEST(PixelFootprint, WithoutCamerasInFrontIsZero) {
  const auto behind = studio::cameraFrom<AcquisitionSpace>({0, 0, -1}, 100);
  TriangleMesh square{{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}}, {{0, 1, 2}}};
  EXPECT_EQ(pixelFootprint(square, std::vector{behind}), 0);
  EXPECT_EQ(pixelFootprint(square, {}), 0);
}

} // namespace

} // namespace surflect::lightfield
