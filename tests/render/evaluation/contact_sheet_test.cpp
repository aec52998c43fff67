#include "render/evaluation/contact_sheet.h"

#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <string>

namespace surflect::evaluation {

namespace {

using V3 = Vec3<double>;
using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

constexpr double kPi = std::numbers::pi;
constexpr int kSize = 80; // of pictures, pixels

capture::Light directional(const V3& towards, Rgb irradiance) {
  return {"D", "D", capture::DirectionalLight{assume<Direction>(towards.normalized()), irradiance}};
}

TriangleMesh sphereMesh(int slices = 192) {
  const image::TemporaryFolder folder;
  studio::writeSphereMesh(folder / "sphere.ply", slices);
  return readMesh(folder / "sphere.ply");
}

// The sphere in the middle of the picture.
OverlayView sphereView(const WhiteSurface& surface, const V3& from, int size = kSize) {
  OverlayView view;
  view.camera = studio::cameraFrom<AcquisitionSpace>(from, size);
  view.silhouette = image::objectMask(capture::silhouette(view.camera, surface.rays()));
  view.window = {0, 0, size, size};
  view.size = {size, size};
  return view;
}

Overlay overlayOfBlack(const OverlayView& view, const capture::Light* light, const WhiteSurface& surface,
                       const image::Image* mask = nullptr) {
  return overlayOf(view, light, image::Image(view.camera.lens.width, view.camera.lens.height, 3), mask,
                   surface, {});
}

// Largest difference of the overlay's geometry from a radiance that is a function of the unit normal.
template <class RadianceAt>
double worstAgainst(const Overlay& overlay, const OverlayView& view, const RadianceAt& radianceAt) {
  const image::Image wanted = studio::overBlack(studio::viewSphere(view.camera, 3), radianceAt);
  double worst = 0;
  for (size_t i = 0; i < wanted.values.size(); ++i)
    if (wanted.values[i / 4 * 4 + 3] == 1) // the limb of a mesh lies elsewhere
      worst = std::max(worst, 1.0 * std::abs(wanted.values[i] - overlay.geometry.values[i]));
  return worst;
}

// A rectangle |x - x0| < half, |y| < half at the height z, facing up.
void addSquare(TriangleMesh& mesh, double x0, double half, double z) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    mesh.positions.push_back(Point(x0 + x * half, y * half, z).cast<float>());
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

// Looks straight down on (x, y).
Rgb seenFromAbove(const WhiteSurface& surface, double x, double y, const capture::Light& light) {
  const auto seen = surface.seen(Point(x, y, 9), Direction(0, 0, -1), &light);
  return seen ? seen->radiance : Rgb{-1, -1, -1};
}

TEST(Overlay, AWhiteSphereIsLambertsInClosedForm) {
  const WhiteSurface surface(sphereMesh());
  const OverlayView view = sphereView(surface, {1, 0.4, 0.7});
  // Where light grazes, flat triangles shade each other.
  constexpr double kGrazing = kPi / 192;
  for (const V3& towards : {V3(1, 0.4, 0.7), V3(0.2, 1, 0.3), V3(-1, 0.2, 0.3)}) {
    const capture::Light light = directional(towards, {1, 2, 3});
    const auto n = towards.normalized().cast<float>().eval();
    const Overlay overlay = overlayOfBlack(view, &light, surface);
    EXPECT_LT(worstAgainst(overlay, view,
                           [&](const Vec3<float>& normal) {
                             return studio::lambert({1, 1, 1}, {1, 2, 3}, normal, n);
                           }),
              3 * kGrazing / kPi);
    EXPECT_EQ(overlay.backShare, 0);
  }
}

TEST(Overlay, APointLightFallsOffWithTheSquareOfTheDistance) {
  const WhiteSurface surface(sphereMesh());
  const OverlayView view = sphereView(surface, {1, 0.4, 0.7});
  const V3 position(2, 1, 2.5);
  const capture::Light light{"P", "P", capture::PointLight{assume<Point>(position), {10, 20, 30}}};
  EXPECT_LT(worstAgainst(overlayOfBlack(view, &light, surface), view,
                         [&](const Vec3<float>& normal) {
                           const V3 toLight = position - normal.cast<double>();
                           const auto perSquare = static_cast<float>(1 / toLight.squaredNorm());
                           return studio::lambert({1, 1, 1}, perSquare * Rgb{10, 20, 30}, normal,
                                                  toLight.normalized().cast<float>());
                         }),
            30 / 2.5 * kPi / 192 / kPi);
}

TEST(Overlay, WithoutALightTheViewerHoldsOne) {
  const WhiteSurface surface(sphereMesh());
  const OverlayView view = sphereView(surface, {0.3, -1, 0.2});
  const V3 eye = view.camera.center().raw();
  EXPECT_LT(worstAgainst(overlayOfBlack(view, nullptr, surface), view,
                         [&](const Vec3<float>& normal) {
                           const V3 toEye = (eye - normal.cast<double>()).normalized();
                           return studio::lambert({1, 1, 1}, {1, 1, 1}, normal, toEye.cast<float>());
                         }),
            1e-3);
}

TEST(Overlay, AShadowLiesWhereTheOccluderIsTowardsTheLight) {
  TriangleMesh mesh;
  addSquare(mesh, 0, 4, 0);
  addSquare(mesh, 2, 0.5, 1); // shades |x - 1| < 0.5 from (1, 0, 1)
  const WhiteSurface surface(mesh);
  const capture::Light slanting = directional({1, 0, 1}, {1, 1, 1});
  const auto lit = static_cast<float>(std::numbers::sqrt2 / 2 / kPi);
  for (const double y : {-0.6, -0.4, 0.0, 0.4, 0.6})
    for (const double x : {0.4, 0.6, 1.0, 1.4}) {
      const bool isShaded = std::abs(x - 1) < 0.5 && std::abs(y) < 0.5;
      EXPECT_FLOAT_EQ(seenFromAbove(surface, x, y, slanting).r, isShaded ? 0 : lit) << x << ' ' << y;
    }
  // The square is beyond a light below it.
  const capture::Light below{"P", "P", capture::PointLight{Point(2, 0, 0.5), {1, 1, 1}}};
  EXPECT_NEAR(seenFromAbove(surface, 1.2, 0, below).r, 0.5 / std::pow(0.64 + 0.25, 1.5) / kPi, 1e-5);
  EXPECT_EQ(seenFromAbove(surface, 2, 0, below).r, 0); // its upper side
}

TEST(Overlay, FacesAreFlatUpToACreaseAndSmoothAcrossABend) {
  // Two squares that share an edge, the second turned about it.
  const auto cosineAtEdge = [](double degrees) {
    const double turn = degrees * kPi / 180;
    TriangleMesh mesh;
    for (const V3& p : {V3(-1, -1, 0), V3(0, -1, 0), V3(0, 1, 0), V3(-1, 1, 0),
                        V3(std::cos(turn), -1, -std::sin(turn)), V3(std::cos(turn), 1, -std::sin(turn))})
      mesh.positions.push_back(assume<Point>(p).cast<float>());
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
    const capture::Light light = directional({1, 0, 0.2}, {1, 1, 1});
    return kPi * seenFromAbove(WhiteSurface(mesh), -1e-4, 0, light).r;
  };
  const auto leaning = [](double degrees) {
    const double lean = degrees * kPi / 180;
    return V3(std::sin(lean), 0, std::cos(lean)).dot(V3(1, 0, 0.2).normalized());
  };
  EXPECT_NEAR(cosineAtEdge(50), leaning(0), 1e-6);
  EXPECT_NEAR(cosineAtEdge(40), leaning(20), 2e-4);
}

TEST(Overlay, AMeshInsideOutShowsItsBackAndNoLight) {
  TriangleMesh mesh = sphereMesh(96);
  for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  const WhiteSurface surface(mesh);
  const Overlay overlay = overlayOfBlack(sphereView(surface, {0, 0, 1}), nullptr, surface);
  EXPECT_EQ(overlay.backShare, 1);
  for (size_t i = 0; i < overlay.geometry.values.size(); ++i)
    if (i % 4 != 3) {
      EXPECT_EQ(overlay.geometry.values[i], 0);
    }
}

TEST(Overlay, TheOutlineIsOnTheAnalyticCircle) {
  const WhiteSurface surface(sphereMesh());
  OverlayView view = sphereView(surface, {0.5, 0.5, 1});
  view.size = {3 * kSize, 3 * kSize};
  image::Image mask(kSize, kSize, 1);
  const double radius = kSize / 2.0 - 7, maskRadius = 20.3; // pixels of the photograph
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) { // antialiased
      const double inside = maskRadius - std::hypot(x + 0.5 - kSize / 2.0, y + 0.5 - kSize / 2.0);
      mask.at(x, y)[0] = static_cast<float>(std::clamp(inside + 0.5, 0.0, 1.0));
    }
  const Overlay overlay = overlayOfBlack(view, nullptr, surface, &mask);
  for (const auto& [outline, expected] :
       {std::pair{&overlay.geometryOutline, 3 * radius}, {&overlay.maskOutline, 3 * maskRadius}}) {
    double sum = 0, weighted = 0;
    for (int y = 0; y < outline->height; ++y)
      for (int x = 0; x < outline->width; ++x) {
        const double r = std::hypot(x + 0.5 - 1.5 * kSize, y + 0.5 - 1.5 * kSize);
        const float share = outline->at(x, y)[0];
        if (share >= 0.5f) {
          EXPECT_NEAR(r, expected, 1) << x << ' ' << y;
        }
        sum += share, weighted += share * r;
      }
    EXPECT_NEAR(weighted / sum, expected, 0.1);
    EXPECT_NEAR(sum / (2 * kPi * expected), 1.6, 0.2); // its width
    for (int degrees = 0; degrees < 360; ++degrees) {
      const double angle = degrees * kPi / 180;
      const auto at = [&](double direction) { return static_cast<int>(1.5 * kSize + expected * direction); };
      EXPECT_GT(outline->at(at(std::cos(angle)), at(std::sin(angle)))[0], 0.25f) << degrees;
    }
  }
}

TEST(Overlay, AWindowShowsThePartOfTheWholePicture) {
  const WhiteSurface surface(sphereMesh(96));
  const capture::Light light = directional({1, 1, 0}, {1, 1, 1});
  OverlayView view = sphereView(surface, {0, 0, 1});
  view.camera.lens.k1 = 0.2;
  const Overlay whole = overlayOfBlack(view, &light, surface);
  view.window = {20, 10, 70, 35};
  view.size = {50, 25};
  const Overlay part = overlayOfBlack(view, &light, surface);
  for (int y = 0; y < 25; ++y)
    for (int x = 0; x < 50; ++x)
      for (size_t c = 0; c < 4; ++c)
        EXPECT_NEAR(part.geometry.at(x, y)[c], whole.geometry.at(x + 20, y + 10)[c], 1e-5);
}

TEST(Overlay, CorrelationIsOneForAnyGainAndMinusOneForTheOpposite) {
  const std::vector<double> a{1, 5, 2, -3, 0.5}, constant(5, 0.1);
  std::vector<double> gained, opposite;
  for (const double value : a) gained.push_back(3 * value - 7), opposite.push_back(-value);
  EXPECT_NEAR(correlation(a, gained), 1, 1e-15);
  EXPECT_NEAR(correlation(a, opposite), -1, 1e-15);
  EXPECT_EQ(correlation(a, constant), 0);
  EXPECT_EQ(correlation({}, {}), 0);
}

class ContactSheets : public ::testing::Test {
protected:
  const studio::Studio smallStudio{.cameras = 5, .lights = 6};
  const image::TemporaryFolder folder;
};

TEST_F(ContactSheets, TheStatedLightAgreesWithThePhotographAndTheFlippedOneDoesNot) {
  studio::Studio studio = smallStudio;
  studio.size = kSize;
  const capture::Capture capture = studio::photograph(studio, folder / "capture");
  const WhiteSurface surface(sphereMesh());
  int lit = 0;
  for (size_t i = 0; i < capture.frames.size(); ++i) {
    const capture::Camera<AcquisitionSpace>& camera = capture.views[capture.frames[i].view].camera;
    capture::Light light = capture.lights[*capture.frames[i].light];
    auto& towards = std::get<capture::DirectionalLight>(light.kind).towards;
    if (dot(towards, capture::Viewpoint(camera).towards(Point(0, 0, 0))) < -0.7)
      continue; // a crescent on the limb
    ++lit;
    const capture::Photograph photograph = capture::readPhotographs(capture, {&i, 1})[0];
    const OverlayView view = sphereView(surface, camera.center().raw());
    const auto agreement = [&] {
      return overlayOf(view, &light, photograph.radiance, &photograph.alpha, surface, {}).shadingCorrelation;
    };
    EXPECT_GT(agreement(), 0.99) << i;
    towards = -towards;
    EXPECT_LE(agreement(), 0) << i;
  }
  EXPECT_GT(lit, 20);
}

TEST_F(ContactSheets, AMeshInPlaceHasTheOverlapThatAShiftedOneLoses) {
  const capture::Capture capture = studio::photograph(smallStudio, folder / "capture");
  TriangleMesh mesh = sphereMesh();
  const auto frames = spreadFrames(capture, 5);
  for (const Overlay& overlay : contactSheet(capture, frames, WhiteSurface(mesh), {}).overlays)
    EXPECT_GT(overlay.maskIou, 0.97) << overlay.camera;
  for (auto& p : mesh.positions) p = p + Direction3<AcquisitionSpace>(0, 0.3f, 0);
  for (const Overlay& overlay : contactSheet(capture, frames, WhiteSurface(mesh), {}).overlays)
    EXPECT_LT(overlay.maskIou, 0.96) << overlay.camera;
}

TEST_F(ContactSheets, GeometryThatNoCameraSeesStillMakesASheet) {
  studio::Studio studio = smallStudio;
  studio.matte = false;
  studio.lights = 0;
  const capture::Capture capture = studio::photograph(studio, folder / "capture");
  TriangleMesh mesh = sphereMesh(24);
  for (auto& p : mesh.positions) p = p + Direction3<AcquisitionSpace>(0, 1000, 0);
  const ContactSheet sheet = contactSheet(capture, spreadFrames(capture, 3), WhiteSurface(mesh), {});
  ASSERT_EQ(sheet.overlays.size(), 3u);
  for (const Overlay& overlay : sheet.overlays) {
    EXPECT_FALSE(overlay.maskIou);
    EXPECT_EQ(overlay.light, "");
    EXPECT_EQ(overlay.shadingCorrelation, 0);
  }
}

TEST_F(ContactSheets, AreTheSameForAnyNumberOfThreads) {
  const capture::Capture capture = studio::photograph(smallStudio, folder / "capture");
  const WhiteSurface surface(sphereMesh(48));
  const auto frames = spreadFrames(capture, 4);
  const ContactSheet many = contactSheet(capture, frames, surface, {});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(contactSheet(capture, frames, surface, {}).image.values, many.image.values);
}

TEST_F(ContactSheets, StayBelow4000PixelsInWidth) {
  studio::Studio studio = smallStudio;
  studio.size = 24;
  studio.cameras = 12;
  studio.lights = 12;
  const capture::Capture capture = studio::photograph(studio, folder / "capture");
  const WhiteSurface surface(sphereMesh(24));
  for (const size_t count : {1u, 2u, 100u}) {
    const ContactSheet sheet = contactSheet(capture, spreadFrames(capture, count), surface, {});
    EXPECT_LT(sheet.image.width, 4000) << count;
    EXPECT_LT(sheet.image.height, 4000) << count;
    EXPECT_EQ(sheet.overlays.size(), count);
  }
}

TEST(SpreadFrames, TakesEachFrameOnceAndViewsAndLightsAlike) {
  capture::Capture capture;
  capture.views.resize(12);
  capture.lights.resize(8);
  for (size_t view = 0; view < 12; ++view)
    for (size_t light = 0; light < 8; ++light) {
      capture::Frame frame;
      frame.view = view;
      frame.light = light;
      capture.frames.push_back(frame);
    }
  for (const size_t count : {1u, 8u, 12u, 24u, 96u, 1000u}) {
    const auto frames = spreadFrames(capture, count);
    ASSERT_EQ(frames.size(), std::min<size_t>(count, 96));
    std::map<size_t, size_t> ofFrame, ofView, ofLight;
    for (const size_t i : frames) {
      ++ofFrame[i];
      ++ofView[capture.frames[i].view];
      ++ofLight[*capture.frames[i].light];
    }
    EXPECT_EQ(ofFrame.size(), frames.size());
    for (const auto& [view, times] : ofView) EXPECT_LE(times, (count + 11) / 12) << count;
    for (const auto& [light, times] : ofLight) EXPECT_LE(times, (count + 7) / 8 + 1) << count;
  }
}

} // namespace

} // namespace surflect::evaluation
