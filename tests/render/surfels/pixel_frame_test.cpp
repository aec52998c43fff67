#include "render/surfels/pixel_frame.h"

#include "render/surfels/outgoing_radiance.h"
#include "render/surfels/surfel_method.h"
#include "render/verify/frame_checks.h"
#include "srf/capture/writer.h"
#include "srf/model/pack.h"
#include "surfel/math/bounds.h"
#include "tests/render/films.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>

namespace surflect::surfels {
namespace {

using studio::largestDifference;
using studio::noWarp;

constexpr int kColumns = 96, kRows = 64; // of photographs: a plane of 9.6 x 6.4 at z = 0

template <class World> capture::Camera<World> ownCamera() {
  capture::Camera<World> camera;
  camera.lens = {.model = capture::Lens::Model::orthographic,
                 .width = kColumns,
                 .height = kRows,
                 .focalX = 10,
                 .focalY = 10,
                 .centerX = kColumns / 2.0,
                 .centerY = kRows / 2.0};
  camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(0, 0, -9)};
  return camera;
}

using AlphaAt = std::function<float(int x, int y)>;

// A textured Lambert plane that faces the only camera, which is orthographic, under 9 lights.
capture::Capture photographPlane(const std::filesystem::path& folder, const AlphaAt& alphaAt) {
  std::filesystem::create_directories(folder);
  capture::Capture capture;
  capture.file = folder / "transforms.json";
  capture.colorSpace = capture::ColorSpace::linear;
  capture::View view{"C", {}};
  view.camera = ownCamera<AcquisitionSpace>();
  capture.views.push_back(view);
  image::Image alpha(kColumns, kRows, 1);
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x) alpha.at(x, y)[0] = alphaAt ? alphaAt(x, y) : 1;
  std::vector<image::Image> pictures;
  for (int l = 0; l < 9; ++l) {
    const double tilt = 0.08 * (l + 1), turn = 2.4 * l;
    const Vec3<double> towards(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn),
                               std::cos(tilt));
    capture.lights.push_back(
        {studio::numbered("L", static_cast<size_t>(l)), studio::numbered("L", static_cast<size_t>(l)),
         capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {3, 3, 3}, {}}});
    image::Image& picture = pictures.emplace_back(kColumns, kRows, 3);
    for (int y = 0; y < kRows; ++y)
      for (int x = 0; x < kColumns; ++x) {
        const double albedo = 0.5 + 0.25 * std::sin(0.4 * x) * std::cos(0.3 * y);
        for (size_t c = 0; c < 3; ++c)
          picture.at(x, y)[c] = static_cast<float>(albedo * towards.z() * (1 - 0.2 * static_cast<double>(c)));
      }
    capture::Frame frame;
    frame.light = static_cast<size_t>(l);
    frame.picture = "C.exr";
    frame.layer = capture.lights.back().identity;
    if (alphaAt) frame.alphaLayer = "matte";
    capture.frames.push_back(frame);
  }
  std::vector<capture::RadianceLayer> layers;
  for (size_t l = 0; l < pictures.size(); ++l) layers.push_back({capture.frames[l].layer, &pictures[l]});
  capture::writeViewPictures(folder / "C.exr", layers, alphaAt ? &alpha : nullptr, "matte");
  capture::writeCapture(capture, folder);
  return capture;
}

struct PackedPlane {
  explicit PackedPlane(const AlphaAt& alphaAt = {}, std::optional<size_t> surfels = {})
      : capture(photographPlane(folder / "capture", alphaAt)) {
    model::PackOptions options;
    options.surfels = surfels;
    options.tolerance = 0.002;
    model::pack(capture, folder / "model", options, {}, nullptr);
    model = model::openModel(folder / "model");
  }
  image::TemporaryFolder folder;
  capture::Capture capture;
  model::Model model;
};

// A pinhole camera before the plane, tilted about x.
capture::Camera<ObjectSpace> pinhole(double distance, double tilt, double focal = 80) {
  capture::Camera<ObjectSpace> camera = ownCamera<ObjectSpace>();
  camera.lens.model = capture::Lens::Model::pinhole;
  camera.lens.focalX = camera.lens.focalY = focal;
  camera.cameraFromWorld = {Eigen::AngleAxisd(tilt, Vec3<double>::UnitX()).toRotationMatrix(),
                            Vec3<double>(0, 0, -distance)};
  return camera;
}

const std::vector<scene::ShotLight> kLamp{scene::ShotDirectionalLight{{0.3, 0.2, 0.93}, {3, 3, 3}}};

double meanAlpha(const image::Image& picture) {
  double sum = 0;
  for (size_t i = 3; i < picture.values.size(); i += 4) sum += static_cast<double>(picture.values[i]);
  return 4 * sum / static_cast<double>(picture.values.size());
}

// The left half is object.
float leftHalf(int x, int) { return x < kColumns / 2 ? 1.f : 0.f; }

class PixelFrame : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    plane = std::make_unique<PackedPlane>();
    half = std::make_unique<PackedPlane>(leftHalf);
  }
  static void TearDownTestSuite() { plane.reset(), half.reset(); }

  static inline std::unique_ptr<PackedPlane> plane, half;
};

TEST_F(PixelFrame, OneRigidMotionOfEverythingLeavesThePictureUnchanged) {
  const capture::Camera<ObjectSpace> camera = pinhole(9, 0.4);
  const image::Image still = studio::filmOf(plane->model, *noWarp(), camera, kLamp).color;
  std::mt19937 random(1);
  for (int i = 0; i < 3; ++i) {
    const studio::RigidMotion motion = studio::randomMotion(random);
    auto lamp = std::get<scene::ShotDirectionalLight>(kLamp[0]);
    lamp.towards = motion.rigid()(lamp.towards);
    const image::Image moved = studio::filmOf(plane->model, *motion.warp(), motion(camera), {lamp}).color;
    EXPECT_LT(largestDifference(still, moved), 2e-3);
  }
}

TEST_F(PixelFrame, APlaneLooksTheSameWithEveryStepOfItsGrid) {
  ASSERT_EQ(plane->model.grid->step, 8);
  // Halvings of tilted squares are chosen for each triangle: 0.0025 is measured.
  for (const auto& camera : {ownCamera<ObjectSpace>(), pinhole(9, 0.4)}) {
    const image::Image coarse = studio::filmOf(plane->model, *noWarp(), camera, kLamp).color;
    for (const auto& [surfels, step] : {std::pair<size_t, int>{10000, 1}, {500, 4}}) {
      const PackedPlane other({}, surfels);
      ASSERT_EQ(other.model.grid->step, step);
      EXPECT_LT(largestDifference(coarse, studio::filmOf(other.model, *noWarp(), camera, kLamp).color), 4e-3);
    }
  }
}

TEST_F(PixelFrame, AnyNumberOfThreadsGivesTheSameBits) {
  FrameOptions options;
  options.aovs = {"normal", "depth", "stretch", "position"};
  const auto warp = warp::bendWarp({0, 1, 0}, {1, 0, 0}, Angle::fromRadians(0.3), {0, 0, 0});
  const auto film = [&] { return studio::filmOf(half->model, *warp, pinhole(9, 0.4), kLamp, options); };
  const FrameLayers many = film();
  tbb::task_arena one(1);
  const FrameLayers few = one.execute(film);
  EXPECT_EQ(many.color.values, few.color.values);
  for (const auto& [name, aov] : many.aovs) EXPECT_EQ(aov.values, few.aovs.at(name).values) << name;
}

TEST_F(PixelFrame, AMirroredWorldGivesTheMirroredPicture) {
  const auto warp = warp::scaleWarp({-1, 1, 1}, {0, 0, 0});
  auto lamp = std::get<scene::ShotDirectionalLight>(kLamp[0]);
  const image::Image still = studio::filmOf(half->model, *noWarp(), pinhole(9, 0.4), {lamp}).color;
  lamp.towards = assume<Direction3<ObjectSpace, double>>(studio::mirror * lamp.towards.raw());
  const image::Image mirrored =
      studio::filmOf(half->model, *warp, studio::mirrored(pinhole(9, 0.4)), {lamp}).color;
  EXPECT_LT(largestDifference(still, studio::flipped(mirrored)), 2e-3);
}

TEST_F(PixelFrame, CornersBesideTheObjectAreNoPartOfIt) {
  const model::Model& model = half->model;
  const Eigen::AlignedBox3d box = boundsOf(placesOnObject(model.cloud));
  EXPECT_NEAR(box.min().x(), -4.8, 1e-4);
  EXPECT_NEAR(box.max().x(), 0, 1e-4);
  EXPECT_NEAR(model.middle.x(), -2.4, 1e-4);
  const DrawnSurfels drawn = drawnSurfels(model, model.cloud.size());
  EXPECT_EQ(drawn.cloud.size(), placesOnObject(model.cloud).size());
  EXPECT_LT(drawn.cloud.size(), model.cloud.size());
  SurfelRenderer renderer(std::make_shared<model::Model>(model::openModel(model.folder)), {});
  EXPECT_EQ(renderer.describe().points.size(), drawn.cloud.size());

  // The shadow of half a plane on the ground below falls on half of it.
  FrameWorkspace workspace(model, size_t{1} << 26);
  const auto still = noWarp();
  const scene::Scene onGround{*still,
                              ownCamera<ObjectSpace>(),
                              {scene::ShotDirectionalLight{{0, 0, 1}, {3, 3, 3}}},
                              scene::ShotGround{{0, 0, -1}, {0, 0, 1}}};
  const image::Image shadow = renderFrame(model, onGround, {}, workspace).shadow;
  for (int y = 0; y < kRows; ++y) EXPECT_LT(shadow.at(kColumns / 2 + 16, y)[0], 0.01f) << y;
}

TEST_F(PixelFrame, EachLayerOfAFoldedSheetShowsThroughTransparentEdges) {
  // Alpha falls to 0 over the last 16 columns of the right half, which is folded over the left one.
  const PackedPlane soft([](int x, int) { return std::min(1.f, static_cast<float>(kColumns - x) / 16.f); });
  const auto fold = warp::expressionWarp(warp::Expression("x > 0 ? -x : x", warp::warpVariables),
                                         warp::Expression("y", warp::warpVariables),
                                         warp::Expression("x > 0 ? 0.5 : 0", warp::warpVariables), {});
  const image::Image film = studio::filmOf(soft.model, *fold, ownCamera<ObjectSpace>(), kLamp).color;
  for (int y = 4; y < kRows - 4; ++y)
    for (int x = 4; x < kColumns / 2 - 10; ++x) EXPECT_GT(film.at(x, y)[3], 0.99f) << x << ' ' << y;
}

TEST_F(PixelFrame, ASquareAcrossTheCameraIsCutThere) {
  // A camera just above the plane that looks along it: the plane fills the lower half, to the border.
  capture::Camera<ObjectSpace> camera = pinhole(0, -1.5707963, 30);
  camera.cameraFromWorld = {camera.cameraFromWorld.rotation(), Vec3<double>::Zero()};
  camera.cameraFromWorld = {camera.cameraFromWorld.rotation(),
                            -(camera.cameraFromWorld.rotation() * Vec3<double>(0, -1, 0.2))};
  const image::Image film = studio::filmOf(plane->model, *noWarp(), camera, kLamp).color;
  for (int x = 4; x < kColumns - 4; ++x) EXPECT_GT(film.at(x, kRows - 1)[3], 0.99f) << x;
  for (const double distance : {1e-3, 1e-9, 1e-30, 1e-300}) {
    const image::Image close = studio::filmOf(plane->model, *noWarp(), pinhole(distance, 0.5), kLamp).color;
    EXPECT_TRUE(std::ranges::all_of(close.values, [](float value) { return std::isfinite(value); }))
        << distance;
  }
}

TEST_F(PixelFrame, MinifiedObjectsAreOpaqueUpToTheBorderOfTheFrame) {
  // The frame shows the middle of the plane, one pixel for 16.
  capture::Camera<ObjectSpace> camera = ownCamera<ObjectSpace>();
  camera.lens.focalX = camera.lens.focalY = 10.0 / 16;
  camera.lens.width = camera.lens.height = 2;
  camera.lens.centerX = camera.lens.centerY = 1;
  const image::Image film = studio::filmOf(plane->model, *noWarp(), camera, kLamp).color;
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 2; ++x) EXPECT_GT(film.at(x, y)[3], 0.999f);
}

TEST_F(PixelFrame, NoDarkFringeSurroundsASquareWithoutPlace) {
  const image::Image whole = studio::filmOf(plane->model, *noWarp(), ownCamera<ObjectSpace>(), kLamp).color;
  const auto hole = warp::expressionWarp(warp::Expression("abs(x) < 0.5 ? sqrt(-1) : x", warp::warpVariables),
                                         warp::Expression("y", warp::warpVariables),
                                         warp::Expression("z", warp::warpVariables), {});
  const image::Image film = studio::filmOf(plane->model, *hole, ownCamera<ObjectSpace>(), kLamp).color;
  EXPECT_LT(meanAlpha(film), 0.95);
  double darkest = 0;
  for (size_t i = 0; i < film.values.size(); i += 4)
    if (film.values[i + 3] > 0)
      darkest = std::max(darkest, double{std::abs(whole.values[i] - film.values[i])});
  EXPECT_LT(darkest, 2e-3);
}

TEST_F(PixelFrame, VerifyChecksThePixelsThatAreDrawn) {
  FrameWorkspace workspace(plane->model, size_t{1} << 26);
  const auto still = noWarp();
  const auto findings =
      verify::frameChecks(plane->model, {*still, ownCamera<ObjectSpace>(), kLamp}, {}, workspace, {});
  for (const verify::Check& check : findings.checks) {
    EXPECT_NE(check.verdict, verify::Verdict::broken) << check.rule->name << ": " << check.finding;
    if (check.rule->name == "frame_weights") EXPECT_EQ(check.verdict, verify::Verdict::kept);
  }
}

TEST_F(PixelFrame, OptionsOfSplatsAreNoneOfAGrid) {
  const auto open = [&] { return std::make_shared<model::Model>(model::openModel(plane->model.folder)); };
  SurfelRenderer renderer(open(), {});
  for (const char* name : {"patch", "surfel_size", "low_pass", "layer_search"})
    EXPECT_EQ(std::ranges::count(renderer.options(), name, &method::Option::name), 0) << name;
  EXPECT_NO_THROW(
      SurfelRenderer(open(), method::settingOf(method::Preset::preview, surfelMethod().renderOptions)));
  EXPECT_THROW(SurfelRenderer(open(), {{"patch", 3.0}}), Error);
}

} // namespace
} // namespace surflect::surfels
