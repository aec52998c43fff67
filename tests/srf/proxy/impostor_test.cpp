#include "srf/proxy/impostor.h"

#include "srf/capture/silhouette.h"
#include "srf/image/mask.h"
#include "srf/shading/shade.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/support/synthetic_capture.h"

#include <algorithm>
#include <cmath>
#include <fstream>

namespace surflect::proxy {

namespace {

using studio::packOptions;
using studio::Studio;

// A sphere of radius 1 around the origin, seen by one camera.
class OneView : public ::testing::Test {
protected:
  capture::Capture photographed() { return studio::photographWithoutMesh(studio, folder / "capture"); }
  model::PackReport packed(const capture::Capture& capture, bool relief) {
    model::PackOptions options = packOptions(1500);
    options.impostor.relief = relief;
    options.overwrite = true;
    return model::pack(capture, folder / "model", options, {}, nullptr);
  }

  image::TemporaryFolder folder;
  Studio studio{.cameras = 1, .lights = 24, .size = 48};
};

TEST_F(OneView, PlaneShowsTheMatteAndHoldsTheOrigin) {
  const capture::Capture capture = photographed();
  const auto& camera = capture.views[0].camera;
  const TriangleMesh mesh = impostorOfOneView(capture, false, {}).mesh;
  const image::Mask truth = image::objectMask(studio::viewSphere(camera, studio.samples).alpha);
  EXPECT_EQ(image::objectMask(capture::silhouette(camera, RayCaster<AcquisitionSpace>(mesh))), truth);
  for (const auto& p : mesh.positions)
    EXPECT_NEAR(camera.cameraFromWorld(p.cast<double>()).z(), -studio::cameraDistance, 1e-6);
}

TEST_F(OneView, WithoutMatteThePictureIsTheObject) {
  studio.matte = false;
  const capture::Capture capture = photographed();
  const auto& camera = capture.views[0].camera;
  const TriangleMesh mesh = impostorOfOneView(capture, false, {}).mesh;
  const image::Image seen = capture::silhouette(camera, RayCaster<AcquisitionSpace>(mesh));
  EXPECT_EQ(std::ranges::count(seen.values, 1.f), 48 * 48);
}

// One camera fixes a shape up to a factor.
TEST_F(OneView, ReliefOfASphereIsTheSphereUpToScale) {
  const capture::Capture capture = photographed();
  const Point3<AcquisitionSpace, double> center = capture.views[0].camera.center();
  const TriangleMesh mesh = impostorOfOneView(capture, true, {}).mesh;
  std::vector<double> ratios;
  for (const auto& p : mesh.positions) {
    const Vec3<double> d = (p.cast<double>() - center).raw().normalized();
    const double b = center.raw().dot(d), discriminant = b * b - center.raw().squaredNorm() + 1;
    if (discriminant < 0.16) continue; // below 24 degrees above grazing
    ratios.push_back((p.cast<double>() - center).raw().norm() / (-b - std::sqrt(discriminant)));
  }
  ASSERT_GT(ratios.size(), 500u);
  const auto [least, most] = std::ranges::minmax(ratios);
  EXPECT_LT(most / least, 1.005); // the sphere itself is 1.3 deep there, of 3 to 4
}

TEST_F(OneView, PackSaysWhichGeometryItMade) {
  const capture::Capture capture = photographed();
  EXPECT_EQ(nameOf(packed(capture, false).geometry), "plane");
  EXPECT_EQ(nameOf(packed(capture, true).geometry), "relief");
  capture::Capture withMesh = capture;
  withMesh.geometry = "mesh.ply";
  EXPECT_EQ(nameOf(packed(withMesh, false).geometry), "mesh");
}

// However the surface is turned: there is nobody else to ask.
TEST_F(OneView, TheOnlyCameraAnswersInAllDirections) {
  for (const bool matte : {true, false})
    for (const bool relief : {true, false}) {
      studio.matte = matte;
      packed(photographed(), relief);
      const model::Model model = model::openModel(folder / "model");
      weights::QueryBatch batch;
      batch.lights = 1;
      const auto directions = studio::spiral(100);
      for (uint32_t i = 0; i < model.cloud.size(); ++i) {
        if (model.visibility.of(i)[0] == 0) continue; // a corner beside the object
        const auto direction = directions[i % directions.size()];
        batch.surfels.push_back(i);
        batch.towardsView.push_back(assume<Direction3<AcquisitionSpace>>(direction));
        batch.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(direction));
        batch.irradiance.push_back({1, 1, 1});
      }
      const shading::ShadingPlan plan = shading::planShading(model, batch, {});
      ASSERT_GT(batch.size(), model.cloud.size() / 3);
      ASSERT_EQ(plan.ops.size(), batch.size());
      for (const shading::ShadingOp& op : plan.ops) EXPECT_EQ(op.weight, 1);
    }
}

TEST_F(OneView, WhatTellsNoReliefIsSaid) {
  const auto expectError = [&](const capture::Capture& capture, const std::string& wanted) {
    const std::string line = image::errorOf([&] { packed(capture, true); });
    EXPECT_NE(line.find(wanted), std::string::npos) << line;
    EXPECT_NE(line.find("transforms.json"), std::string::npos) << line;
  };
  studio.lights = 2;
  expectError(photographed(), "found 2, expected photographs under three lights or more");
  studio.lights = 0;
  expectError(photographed(), "fixed illumination");
  studio.cameras = 2;
  studio.lights = 4;
  expectError(photographed(), "found 2, expected one view");
}

TEST_F(OneView, ABlackMatteShowsNothing) {
  const capture::Capture capture = photographed();
  const image::Image black(studio.size, studio.size, 1);
  const image::Image radiance(studio.size, studio.size, 3);
  std::vector<capture::RadianceLayer> layers;
  for (const capture::Frame& frame : capture.frames) layers.push_back({frame.layer, &radiance});
  capture::writeViewPictures(folder / "capture/C0.exr", layers, &black, "matte");
  const std::string line = image::errorOf([&] { packed(capture, false); });
  EXPECT_NE(line.find("shows anything of the object"), std::string::npos) << line;
}

} // namespace

namespace {

class ImpostorOf : public ::testing::Test {
protected:
  capture::Capture photographed() { return studio::photographWithoutMesh(studio, folder / "capture"); }

  image::TemporaryFolder folder;
  studio::Studio studio{.cameras = 8, .lights = 1};
};

TEST_F(ImpostorOf, SeveralViewsWithMattesIsTheirHull) {
  const Impostor impostor = impostorOf(photographed(), {}, {});
  EXPECT_EQ(impostor.origin, Impostor::Origin::hull);
  ASSERT_EQ(impostor.fits.size(), 8u);
  for (const auto& fit : impostor.fits) {
    EXPECT_GT(fit.intersectionOverUnion, 0.95);
    EXPECT_FALSE(fit.leftOut);
  }
  EXPECT_EQ(impostor.fits[3].view, "C3");
  for (const auto& p : impostor.mesh.positions) EXPECT_NEAR(p.raw().norm(), 1.1f, 0.15f);
}

TEST_F(ImpostorOf, AMeshComesFirst) {
  capture::Capture capture = photographed();
  capture.geometry = "mesh.ply";
  const Impostor impostor = impostorOf(capture, {}, {});
  EXPECT_EQ(impostor.origin, Impostor::Origin::given);
  EXPECT_TRUE(impostor.fits.empty());
}

TEST_F(ImpostorOf, AMeshInsideOutIsTurnedAndTold) {
  capture::Capture capture = photographed();
  capture.geometry = "inverted.obj";
  const TriangleMesh sound = readMesh(folder / "capture/mesh.ply");
  std::ofstream obj(folder / "capture/inverted.obj");
  for (const auto& p : sound.positions) obj << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& [a, b, c] : sound.triangles) obj << "f " << a + 1 << ' ' << c + 1 << ' ' << b + 1 << '\n';
  obj.close();
  const Impostor impostor = impostorOf(capture, {}, {});
  EXPECT_EQ(impostor.mesh.triangles, sound.triangles);
  ASSERT_EQ(impostor.notes.size(), 1u);
  EXPECT_TRUE(impostor.notes[0].starts_with((folder / "capture/inverted.obj").string() + ": "));
  capture.geometry = "mesh.ply";
  EXPECT_TRUE(impostorOf(capture, {}, {}).notes.empty());
}

TEST_F(ImpostorOf, SeveralViewsWithoutMattesIsAnErrorWithBothWaysOut) {
  studio.matte = false;
  const std::string error = image::errorOf([&] { impostorOf(photographed(), {}, {}); });
  EXPECT_NE(error.find("--mesh"), std::string::npos);
  EXPECT_NE(error.find("--mask-from"), std::string::npos);
  EXPECT_NE(error.find("transforms.json"), std::string::npos);
}

} // namespace

} // namespace surflect::proxy
