#include "render/lightfield/lfm/joined.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

// A ball with two terms, and a patch of another white with three.
std::vector<LightFieldMaps> twoModels() {
  std::vector<LightFieldMaps> models{syntheticMaps(bumpySphere(8, 6), {.terms = 2, .seed = 3}),
                                     syntheticMaps(squarePatch(2), {.terms = 3, .seed = 4})};
  models[1].meanWhite = 0.9f;
  return models;
}

std::vector<PlacedObject> threeObjects() {
  const Mat3<double> turned = Eigen::AngleAxisd(0.7, Vec3<double>(1, 2, -1).normalized()).toRotationMatrix();
  return {{0, {}}, {1, {0.4, turned, {3, -1, 2}}}, {0, {2.5, turned.transpose(), {-6, 0, 1}}}};
}

TEST(JoinedMaps, RadianceOfAPlacedObjectIsThatOfItsModel) {
  const std::vector<LightFieldMaps> models = twoModels();
  const std::vector<PlacedObject> objects = threeObjects();
  const LightFieldMaps scene = joined(models, objects);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 1);
  std::normal_distribution<double> normal;
  size_t firstTriangle = 0;
  for (const PlacedObject& object : objects) {
    const LightFieldMaps& model = models[object.model];
    // Bytes of the darker model's mean are rounded to the brighter one's white.
    const double rounding = model.meanWhite < scene.meanWhite ? 0.5 * double{scene.meanWhite} / 255 : 0;
    for (int i = 0; i < 200; ++i) {
      const auto triangle = static_cast<size_t>(number(random) * double(model.mesh.triangles.size()));
      double a = number(random), b = number(random);
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const Vec3<double> d = Vec3<double>(normal(random), normal(random), normal(random)).normalized();
      const Vec3<double> turned = object.placement.rotation * d;
      const Vec3<double> before = radianceAt(model, {triangle, a, b}, assume<Direction>(d), kMostTerms);
      const Vec3<double> after =
          radianceAt(scene, {firstTriangle + triangle, a, b}, assume<Direction>(turned), kMostTerms);
      EXPECT_LE((after.cwiseSqrt() - before.cwiseSqrt()).cwiseAbs().maxCoeff(), rounding + 1e-9);
    }
    firstTriangle += model.mesh.triangles.size();
  }
  EXPECT_EQ(firstTriangle, scene.mesh.triangles.size());
}

TEST(JoinedMaps, AModelIsStoredOnceForAllItsObjects) {
  const std::vector<LightFieldMaps> models = twoModels();
  const LightFieldMaps two = joined(models, std::vector<PlacedObject>{{0, {}}, {1, {}}}),
                       three = joined(models, threeObjects());
  const MapBytes small = bytesOf(two), large = bytesOf(three);
  EXPECT_EQ(large.surface, small.surface);
  EXPECT_EQ(large.view, small.view);
  EXPECT_EQ(large.mean, small.mean);
  EXPECT_EQ(large.surface, bytesOf(models[0]).surface + bytesOf(models[1]).surface);
}

TEST(JoinedMaps, OneObjectAtItsPlaceIsTheModel) {
  const std::vector<LightFieldMaps> models{syntheticMaps(bumpySphere(8, 6))};
  const LightFieldMaps scene = joined(models, std::vector<PlacedObject>{{0, {}}});
  EXPECT_EQ(scene.mean.maps.data, models[0].mean.maps.data);
  EXPECT_EQ(scene.meanWhite, models[0].meanWhite);
  ASSERT_EQ(scene.terms.size(), models[0].terms.size());
  for (size_t k = 0; k < scene.terms.size(); ++k) {
    EXPECT_EQ(scene.terms[k].surface.maps.data, models[0].terms[k].surface.maps.data);
    EXPECT_TRUE(isIdentity(scene.terms[k].view));
  }
}

TEST(JoinedMaps, ModelsThatDoNotFitAreNamed) {
  const auto errorWith = [](const std::function<void(LightFieldMaps&)>& change) {
    std::vector<LightFieldMaps> models{syntheticMaps(squarePatch(2)), syntheticMaps(squarePatch(2))};
    change(models[1]);
    return image::errorOf([&] { joined(models, std::vector<PlacedObject>{{0, {}}, {1, {}}}); });
  };
  EXPECT_EQ(errorWith([](LightFieldMaps& maps) { maps = syntheticMaps(squarePatch(2), {.samples = 7}); }),
            "model[1].samples: found 7, expected 6");
  EXPECT_EQ(errorWith([](LightFieldMaps& maps) { maps = syntheticMaps(squarePatch(2), {.viewSize = 9}); }),
            "model[1].viewSize: found 9, expected 8");
  EXPECT_EQ(errorWith([](LightFieldMaps& maps) { maps = withHigherViewSize(std::move(maps), 4); }),
            "model[1].higherViewSize: found 4, expected 8");
  EXPECT_EQ(errorWith([](LightFieldMaps& maps) {
              maps = syntheticMaps(squarePatch(2), {.method = Factorization::nmf});
            }),
            "model[1].method: found nmf, expected pca");
  EXPECT_EQ(errorWith([](LightFieldMaps& maps) { maps = encoded(std::move(maps)); }),
            "model[1].coding: has S3TC blocks, expected bytes: encode the scene instead");
  EXPECT_EQ(errorWith([](LightFieldMaps& maps) {
              for (Term& term : maps.terms) term.surface = scalarTable(term.surface, maps.samples);
              maps.layout = SurfaceLayout::scalar;
            }),
            "model[1].maps: found with codebooks, expected without codebooks");
}

TEST(JoinedMaps, MemoryGrowsWithTheObjects) {
  const std::vector<LightFieldMaps> models{syntheticMaps(squarePatch(2))};
  const double one = memoryOf(models, std::vector<PlacedObject>(1));
  EXPECT_GT(one, 0);
  EXPECT_DOUBLE_EQ(memoryOf(models, std::vector<PlacedObject>(1000)), 1000 * one);
}

TEST(JoinedMaps, PlacedCamerasSeeThePlacedObjectAsBefore) {
  const std::vector<PlacedObject> objects = threeObjects();
  capture::Capture rig;
  rig.views.push_back({"front", studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, 64)});
  rig.views.push_back({"flat", studio::cameraFrom<AcquisitionSpace>({-1, 0, 1}, 64)});
  rig.views[1].camera.lens.model = capture::Lens::Model::orthographic;
  rig.lights.push_back(
      {"lamp", "lamp", capture::PointLight{Point3<AcquisitionSpace, double>(1, 0, 0), {1, 1, 1}}});
  rig.frames = {{.view = 0, .light = 0, .picture = "a.exr"}, {.view = 1, .light = 0, .picture = "b.exr"}};
  const std::array rigs{&rig, &rig};
  const capture::Capture scene = joinedRig(rigs, objects);
  ASSERT_EQ(scene.views.size(), 6u);
  ASSERT_EQ(scene.frames.size(), 6u);
  EXPECT_EQ(scene.views[3].identity, "1/flat");
  EXPECT_EQ(scene.frames[5].picture, "2/b.exr");
  EXPECT_TRUE(scene.lights.empty());
  const Point3<AcquisitionSpace> p(0.3f, -0.2f, 0.5f);
  for (size_t i = 0; i < scene.frames.size(); ++i) {
    EXPECT_FALSE(scene.frames[i].light);
    EXPECT_EQ(scene.frames[i].view, i);
    const auto before =
        rig.views[i % 2].camera.project(assume<Point3<AcquisitionSpace, double>>(p.raw().cast<double>()));
    const auto after = scene.views[i].camera.project(
        assume<Point3<AcquisitionSpace, double>>(objects[i / 2].placement(p).raw().cast<double>()));
    ASSERT_TRUE(before && after);
    EXPECT_NEAR(after->x, before->x, 1e-4); // places are single floats
    EXPECT_NEAR(after->y, before->y, 1e-4);
  }
}

} // namespace
} // namespace surflect::lfm
