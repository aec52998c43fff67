#include "srf/proxy/impostor.h"

#include "tests/support/synthetic_capture.h"

#include <fstream>

namespace surflect::proxy {
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
  EXPECT_NE(error.find("--mask-threshold"), std::string::npos);
  EXPECT_NE(error.find("transforms.json"), std::string::npos);
}

} // namespace
} // namespace surflect::proxy
