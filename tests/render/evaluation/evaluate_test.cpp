#include "render/evaluation/evaluate.h"

#include "render/methods.h"
#include "render/surfels/surfel_method.h"
#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace surflect::evaluation {

namespace {

image::Image opaque(int width, int height, float gray) {
  image::Image image(width, height, 4);
  image.values.assign(image.values.size(), gray);
  for (size_t i = 3; i < image.values.size(); i += 4) image.values[i] = 1;
  return image;
}

image::Image filled(int width, int height, float value) {
  image::Image image(width, height, 1);
  image.values.assign(image.values.size(), value);
  return image;
}

TEST(TileErrors, AreRootMeanSquaresAfterTheExposure) {
  const TileErrors tiles =
      tileErrors(opaque(32, 16, 0.25f), opaque(32, 16, 0.375f), filled(32, 16, 0.0625f), 2);
  ASSERT_EQ(tiles.measured.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_DOUBLE_EQ(tiles.measured[i], 0.25);
    EXPECT_DOUBLE_EQ(tiles.predicted[i], 0.125);
    EXPECT_DOUBLE_EQ(tiles.brightness[i], 0.75);
  }
}

// One pixel in a tile of 256 is wrong, by 0.5 in one channel of three.
TEST(TileErrors, ASinglePixelCountsByItsShare) {
  const image::Image truth = opaque(16, 16, 0.25f);
  image::Image rendered = truth;
  rendered.at(3, 7)[1] = 0.75f;
  EXPECT_DOUBLE_EQ(tileErrors(truth, rendered, filled(16, 16, 0), 1).measured.at(0),
                   std::sqrt(0.25 / 3 / 256));
}

// Pictures of 19 and 20 columns: the second of two tiles has 3 or 4 of its 16 columns.
TEST(TileErrors, TilesWithLittleOfTheObjectAreLeftOut) {
  EXPECT_EQ(tileErrors(opaque(19, 16, 0.5f), opaque(19, 16, 0.5f), filled(19, 16, 1), 1).measured.size(), 1u);
  EXPECT_EQ(tileErrors(opaque(20, 16, 0.5f), opaque(20, 16, 0.5f), filled(20, 16, 1), 1).measured.size(), 2u);
  EXPECT_TRUE(
      tileErrors(image::Image(32, 32, 4), image::Image(32, 32, 4), filled(32, 32, 1), 1).measured.empty());
}

TEST(TileErrors, TexelsThatAreNoNumberInTheTruthAreLeftOut) {
  image::Image truth = opaque(16, 16, 0.5f);
  truth.at(0, 0)[0] = NAN;
  image::Image predicted = filled(16, 16, 0.5f);
  predicted.at(0, 0)[0] = 100;
  const TileErrors tiles = tileErrors(truth, opaque(16, 16, 0.5f), predicted, 1);
  EXPECT_DOUBLE_EQ(tiles.measured.at(0), 0);
  EXPECT_DOUBLE_EQ(tiles.predicted.at(0), 0.5);
}

TEST(TileErrors, RelativeOnesAreOverTheBrightnessOfTilesThatAreNotBlack) {
  const TileErrors relative = relativeErrors({{0.1, 0.2, 0.3}, {0.2, 0.2, 0.2}, {0.5, 0, 0.25}});
  EXPECT_EQ(relative.measured, (std::vector<double>{0.2, 1.2}));
  EXPECT_EQ(relative.predicted, (std::vector<double>{0.4, 0.8}));
}

} // namespace

namespace {

using studio::PackedStudio;
using studio::Studio;

constexpr int pictureSize = 32; // pixels

Studio testStudio() { return {.cameras = 9, .lights = 12, .size = pictureSize}; }

Evaluation evaluated(const model::Model& model, const capture::Capture& capture, EvaluateOptions options = {},
                     bool withNearest = false) {
  const std::shared_ptr<const model::Model> notOwned(std::shared_ptr<const model::Model>(), &model);
  surfels::SurfelRenderer renderer(notOwned, {}), nearest(notOwned, {{"interpolation", "nearest"}});
  if (withNearest) options.others["nearest"] = &nearest;
  return evaluate(renderer, capture, *warp::chainWarp({}), options);
}

EvaluateOptions ofTraining() {
  EvaluateOptions options;
  options.split = capture::Split::train;
  return options;
}

// Cameras 2 and 5 and lights 3 and 7 have no frame that trains.
std::optional<capture::Split> heldOut(size_t view, size_t light) {
  return view == 2 || view == 5 || light == 3 || light == 7 || (view == 0 && light == 0)
             ? capture::Split::test
             : capture::Split::train;
}

// A texel that is NaN in the truth of one frame is in no score.
TEST(Evaluate, TruthRenderedByTheProgramItselfIsMet) {
  constexpr size_t invalid = pictureSize / 2 * (pictureSize + 1); // in the middle
  Studio studio = testStudio();
  const PackedStudio packed(studio, 1200);
  capture::Capture capture = packed.capture;
  const auto folder = packed.folder / "rendered";
  std::filesystem::create_directories(folder);
  capture.frames.clear();
  surfels::FrameWorkspace workspace(packed.model, size_t{1} << 28);
  const auto turn = warp::rigidWarp({0.6, 0, 0.8}, Angle::fromDegrees(50), {0, 0, 0}, {0.05, 0, 0});
  for (size_t v = 0; v < 4; ++v) {
    const auto& pose = capture.views[v].camera.cameraFromWorld;
    const capture::Camera<ObjectSpace> camera{capture.views[v].camera.lens,
                                              {pose.rotation(), pose.translation()}};
    const scene::Scene scene{*turn, camera, {scene::inObjectSpace(capture.lights[v])}};
    const image::Image film = surfels::renderFrame(packed.model, scene, {}, workspace).color;
    image::Image straight(pictureSize, pictureSize, 3), alpha(pictureSize, pictureSize, 1);
    for (size_t i = 0; i < alpha.values.size(); ++i) {
      alpha.values[i] = film.values[4 * i + 3];
      for (size_t c = 0; alpha.values[i] > 0 && c < 3; ++c)
        straight.values[3 * i + c] = film.values[4 * i + c] / alpha.values[i];
    }
    if (v == 1) straight.values[3 * invalid] = NAN;
    const std::string name = studio::numbered("frame", v) + ".exr";
    capture::writeViewPictures(folder / name, std::vector<capture::RadianceLayer>{{"", &straight}}, &alpha,
                               "", image::Precision::single);
    capture::Frame frame;
    frame.view = v;
    frame.light = v;
    frame.picture = name;
    frame.split = capture::Split::test;
    capture.frames.push_back(frame);
  }
  capture.geometry.clear();
  capture::writeCapture(capture, folder);

  const auto renderer = method::openRenderer(packed.model.folder);
  const Evaluation evaluation = evaluate(*renderer, capture::readCapture(folder), *turn);
  ASSERT_EQ(evaluation.frames.size(), 4u);
  EXPECT_EQ(evaluation.frames[1].invalidTexels, 1u);
  constexpr double single = 160; // dB; a rounding of floats here and there, measured 163.7
  for (const FrameScore& frame : evaluation.frames) {
    EXPECT_GT(frame.score.difference.psnrLinear(), single);
    EXPECT_GT(frame.score.difference.psnrSrgb(), single);
    EXPECT_NEAR(frame.score.difference.ssim(), 1, 8e-15); // twenty roundings of its own, measured 4.4e-15
    EXPECT_GT(psnr(frame.score.interiorError.mean()), single);
    EXPECT_EQ(frame.maskIou, 1);
  }
}

TEST(Evaluate, CapturedFramesComeBack) {
  const PackedStudio packed(testStudio(), 2000);
  Score pooled;
  for (const FrameScore& frame : evaluated(packed.model, packed.capture, ofTraining()).frames) {
    EXPECT_EQ(frame.group, "known");
    EXPECT_GT(frame.maskIou, 0.95);
    pooled += frame.score;
  }
  EXPECT_EQ(pooled.frames, 9u * 12u);
  EXPECT_GT(psnr(pooled.interiorError.mean()), 47);
}

// New lights between captured ones, all of them brighter here than there, each in its own way. Blends are of
// what fell on the surfel, so that it does not matter.
TEST(Evaluate, UnevenLightsAreAsGoodAsEvenOnes) {
  const auto packed = [](double unevenness) {
    Studio studio = testStudio();
    studio.cameras = 5;
    studio.lights = 40;
    studio.unevenness = unevenness;
    studio.split = [](size_t, size_t light) {
      return light % 5 == 0 ? capture::Split::test : capture::Split::train;
    };
    return PackedStudio(studio, 2000);
  };
  const auto interior = [](const PackedStudio& studio) {
    Score pooled;
    for (const FrameScore& frame : evaluated(studio.model, studio.capture).frames) pooled += frame.score;
    return psnr(pooled.interiorError.mean());
  };
  const PackedStudio even = packed(0);
  EXPECT_GT(interior(even), 54);
  PackedStudio uneven = packed(0.5);
  EXPECT_GT(interior(uneven), 52);
  // Taken for even ones.
  for (capture::Light& light : uneven.model.rig.lights)
    std::get<capture::DirectionalLight>(light.kind).irradianceGradient.setZero();
  EXPECT_LT(interior(uneven), 27);
}

TEST(Evaluate, GroupsGoByIdentity) {
  Studio studio = testStudio();
  studio.split = heldOut;
  PackedStudio packed(studio, 300);
  // A test light of another name, in the place where a training light was, is known.
  auto& lights = packed.capture.lights;
  lights[7].identity = lights[6].identity;
  capture::writeCapture(packed.capture, packed.folder / "capture");
  const capture::Capture capture = capture::readCapture(packed.folder / "capture");
  const Evaluation evaluation = evaluated(packed.model, capture);
  EXPECT_EQ(evaluation.frames.size(), 2u * 12 + 7 * 2 + 1);
  for (const FrameScore& frame : evaluation.frames) {
    const bool knownCamera = frame.camera != "C2" && frame.camera != "C5";
    const bool knownLight = frame.light != "L3";
    EXPECT_EQ(frame.group,
              knownCamera ? (knownLight ? "known" : "new_light") : (knownLight ? "new_camera" : "new_both"))
        << frame.camera << ' ' << frame.light;
  }
}

TEST(Evaluate, ScoresAreTheSameInAnyOrderOfFrames) {
  Studio studio = testStudio();
  studio.split = heldOut;
  const PackedStudio packed(studio, 300);
  capture::Capture reversed = packed.capture;
  std::ranges::reverse(reversed.frames);
  const Evaluation a = evaluated(packed.model, packed.capture), b = evaluated(packed.model, reversed);
  EXPECT_EQ(a.exposure, b.exposure);
  for (const FrameScore& frame : a.frames) {
    const auto same = std::ranges::find_if(b.frames, [&](const FrameScore& other) {
      return other.camera == frame.camera && other.light == frame.light;
    });
    ASSERT_NE(same, b.frames.end());
    EXPECT_EQ(same->score.interiorError.sum, frame.score.interiorError.sum);
  }
}

TEST(Evaluate, BaselineOnlyWhenAsked) {
  Studio studio = testStudio();
  studio.split = heldOut;
  const PackedStudio packed(studio, 300);
  for (const FrameScore& frame : evaluated(packed.model, packed.capture).frames)
    EXPECT_TRUE(frame.others.empty());
  size_t different = 0;
  for (const FrameScore& frame : evaluated(packed.model, packed.capture, {}, true).frames) {
    ASSERT_TRUE(frame.others.contains("nearest"));
    different += frame.others.at("nearest").interiorError.sum != frame.score.interiorError.sum;
  }
  EXPECT_GT(different, 0u);
}

// One camera and no mesh. Every third light is kept back.
Studio oneViewStudio() {
  Studio studio = testStudio();
  studio.cameras = 1;
  studio.lights = 24;
  studio.split = [](size_t, size_t light) {
    return light % 3 == 0 ? capture::Split::test : capture::Split::train;
  };
  return studio;
}

struct OneView {
  image::TemporaryFolder folder;
  capture::Capture capture;
  model::Model model;

  explicit OneView(const Studio& studio) : capture(photograph(studio, folder / "capture")) {
    capture.geometry.clear();
    capture::writeCapture(capture, folder / "capture");
    model::pack(capture, folder / "model", studio::packOptions(4000), {}, nullptr);
    model = model::openModel(folder / "model");
  }
};

double interiorPsnr(const Evaluation& evaluation, const std::string& baseline) {
  Score pooled;
  for (const FrameScore& frame : evaluation.frames) pooled += frame.others.at(baseline);
  return psnr(pooled.interiorError.mean());
}

// The studio's sphere is one.
TEST(Evaluate, TheLambertBaselineOfALambertSurfaceIsExactWhateverLightIsNew) {
  const OneView view(oneViewStudio());
  EvaluateOptions options;
  options.lambert = true;
  const Evaluation evaluation = evaluated(view.model, view.capture, options, true);
  EXPECT_EQ(evaluation.frames.size(), 8u);
  EXPECT_GT(interiorPsnr(evaluation, "lambert"), 50);
  EXPECT_LT(interiorPsnr(evaluation, "nearest"), 30);
}

TEST(Evaluate, TheLambertBaselineNeedsPhotographsOfTheFramesCamera) {
  Studio studio = testStudio();
  studio.split = heldOut;
  const PackedStudio packed(studio, 300);
  EvaluateOptions options;
  options.lambert = true;
  const std::string line = image::errorOf([&] { evaluated(packed.model, packed.capture, options); });
  EXPECT_NE(line.find("the Lambert baseline of C2: found 0, expected photographs under three"),
            std::string::npos)
      << line;
}

TEST(Evaluate, AViewWithoutMatteIsMeasuredOnItsWholePicture) {
  Studio studio = oneViewStudio();
  studio.matte = false;
  const OneView view(studio);
  for (const FrameScore& frame : evaluated(view.model, view.capture).frames)
    EXPECT_EQ(frame.score.interiorError.count, 3u * pictureSize * pictureSize);
}

TEST(Evaluate, ExposureMapsThe995thPercentileToOne) {
  Studio studio = testStudio();
  studio.split = heldOut;
  const PackedStudio packed(studio, 300);
  std::vector<float> values;
  for (size_t i = 0; i < packed.capture.frames.size(); ++i) {
    if (packed.capture.frames[i].split != capture::Split::test) continue;
    const capture::Photograph photograph = capture::readPhotographs(packed.capture, std::vector{i})[0];
    for (size_t v = 0; v < photograph.radiance.values.size(); ++v)
      if (const float alpha = photograph.alpha.values[v / 3]; alpha > 0.5f)
        values.push_back(alpha * photograph.radiance.values[v]);
  }
  std::ranges::sort(values);
  const double white = values[static_cast<size_t>(0.995 * static_cast<double>(values.size()))];
  EXPECT_NEAR(evaluated(packed.model, packed.capture).exposure * white, 1, 1.0 / 4096);
}

TEST(Evaluate, ACaptureMayCountFromAnotherOriginThanTheModel) {
  const PackedStudio packed(testStudio(), 300);
  const auto errorOf = [&](const Vec3<double>& origin) {
    const Evaluation evaluation =
        evaluated(packed.model, capture::countedFrom(packed.capture, origin), ofTraining());
    return evaluation.frames[5].score.interiorError.mean();
  };
  EXPECT_NEAR(errorOf({500000, 4600000, 30}) / errorOf({0, 0, 0}), 1, 1e-5);
}

// pack leaves it out as well.
TEST(Evaluate, AFarSpeckInTheGeometryIsNoObject) {
  Studio studio = testStudio();
  studio.matte = false;
  const PackedStudio packed(studio, 300);
  capture::Capture capture = packed.capture;
  const auto scores = [&] {
    std::vector<double> all;
    for (const FrameScore& frame : evaluated(packed.model, capture, ofTraining()).frames) {
      all.push_back(frame.maskIou);
      all.push_back(frame.score.interiorError.mean());
    }
    return all;
  };
  const auto without = scores();
  const TriangleMesh mesh = readMesh(capture.folder() / capture.geometry);
  capture.geometry = "specked.obj";
  std::ofstream obj(capture.folder() / capture.geometry);
  const auto add = [&](const Vec3<double>& p) { obj << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n'; };
  for (const auto& p : mesh.positions) add(p.raw().cast<double>());
  const auto worldFromCamera = capture.views[5].camera.cameraFromWorld.inverse();
  for (const auto& [x, y] : {std::pair(0., 0.), {0.5, 0.}, {0., 0.5}}) // beside the sphere, and far behind it
    add(worldFromCamera(Point3<CameraSpace, double>(2.9 + x, y, -9)).raw());
  for (const auto& [a, b, c] : mesh.triangles) obj << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
  obj << "f -3 -2 -1\n";
  obj.close();
  EXPECT_EQ(scores(), without);
}

TEST(Evaluate, FixedIlluminationHasNoLight) {
  Studio studio = testStudio();
  studio.lights = 0;
  studio.split = [](size_t view, size_t) { return view == 4 ? capture::Split::test : capture::Split::train; };
  const PackedStudio packed(studio, 1000);
  const Evaluation evaluation = evaluated(packed.model, packed.capture);
  ASSERT_EQ(evaluation.frames.size(), 1u);
  EXPECT_EQ(evaluation.frames[0].light, "");
  EXPECT_EQ(evaluation.frames[0].group, "new_camera");
  EXPECT_GT(psnr(evaluation.frames[0].score.interiorError.mean()), 44);
}

// A photograph that names no light is rendered under those of the options; here it was taken under light 2.
TEST(Evaluate, PhotographsWithoutALightHaveThoseOfTheOptions) {
  const PackedStudio packed(testStudio(), 1000);
  capture::Capture capture = packed.capture;
  std::erase_if(capture.frames, [](const capture::Frame& frame) { return frame.light != 2u; });
  const auto pooled = [&](const EvaluateOptions& options, const std::string& group) {
    Score sum;
    for (const FrameScore& frame : evaluated(packed.model, capture, options).frames) {
      EXPECT_EQ(frame.group, group);
      EXPECT_EQ(frame.frontLit.has_value(), group == "known");
      sum += frame.score;
    }
    return sum.difference.psnrLinear();
  };
  EvaluateOptions options = ofTraining();
  const double named = pooled(options, "known");
  options.lights = {scene::inObjectSpace(capture.lights[3])};
  EXPECT_EQ(pooled(options, "known"), named); // which the photographs do not need
  for (capture::Frame& frame : capture.frames) frame.light.reset();
  options.lights = {scene::inObjectSpace(capture.lights[2])};
  EXPECT_EQ(pooled(options, "new_light"), named);
  options.lights = {scene::inObjectSpace(capture.lights[3])};
  EXPECT_LT(pooled(options, "new_light"), named - 3);
}

class Mismatches : public testing::Test {
protected:
  const PackedStudio packed{[] {
                              Studio studio = testStudio();
                              studio.split = heldOut;
                              return studio;
                            }(),
                            300};
  capture::Capture capture = packed.capture;

  std::vector<std::string> found() const {
    const std::shared_ptr<const model::Model> notOwned(std::shared_ptr<const model::Model>(), &packed.model);
    return rigMismatches(surfels::SurfelRenderer(notOwned, {}).describe(), capture);
  }
};

TEST_F(Mismatches, ThereAreNoneWithTheCaptureThatWasPacked) {
  EXPECT_TRUE(found().empty());
  capture = capture::countedFrom(capture, {0.5, -1, 2});
  EXPECT_TRUE(found().empty());
}

TEST_F(Mismatches, ACaptureOfAnotherScaleHasCamerasElsewhere) {
  for (capture::View& view : capture.views) {
    auto& pose = view.camera.cameraFromWorld;
    pose = {pose.rotation(), 1.5 * pose.translation()};
  }
  ASSERT_EQ(found().size(), 1u);
  EXPECT_NE(found()[0].find("7 of 7 cameras stand elsewhere"), std::string::npos) << found()[0];
}

// Views share the name of a camera that moves, and lights that of a cluster.
TEST(RigMismatches, NamesMayBeShared) {
  Studio studio = testStudio();
  studio.split = heldOut;
  PackedStudio packed(studio, 300);
  const std::shared_ptr<const model::Model> notOwned(std::shared_ptr<const model::Model>(), &packed.model);
  method::Description model = surfels::SurfelRenderer(notOwned, {}).describe();
  for (capture::Capture* capture : {&model.rig, &packed.capture}) {
    for (capture::View& view : capture->views) view.identity = "moving";
    for (capture::Light& light : capture->lights) light.identity = "cluster";
  }
  EXPECT_TRUE(rigMismatches(model, packed.capture).empty());
}

TEST_F(Mismatches, AnotherRigHasNoCameraInCommon) {
  for (capture::View& view : capture.views) view.identity += " of another day";
  ASSERT_EQ(found().size(), 1u);
  EXPECT_NE(found()[0].find("none of the 7 training cameras is among the 7"), std::string::npos)
      << found()[0];
}

TEST_F(Mismatches, LightsOfAnotherStrengthOrDirectionAreNamed) {
  Rgb& irradiance = std::get<capture::DirectionalLight>(capture.lights[1].kind).irradiance;
  irradiance = 100.f * irradiance;
  auto& turned = std::get<capture::DirectionalLight>(capture.lights[4].kind).towards;
  turned = assume<Direction3<AcquisitionSpace, double>>(-turned.raw());
  ASSERT_EQ(found().size(), 2u);
  EXPECT_NE(found()[0].find("lights shine from another direction"), std::string::npos) << found()[0];
  EXPECT_NE(found()[1].find("(100 times)"), std::string::npos) << found()[1];
}

TEST(Evaluate, SilhouettesThatOverlapBadlyAreSaid) {
  Evaluation evaluation;
  evaluation.frames.resize(3);
  for (FrameScore& frame : evaluation.frames) frame.maskIou = 0.95;
  evaluation.frames[0].maskIou = 0.1; // one bad frame is no other object
  EXPECT_FALSE(silhouetteMismatch(evaluation));
  for (FrameScore& frame : evaluation.frames) frame.maskIou = 0.43;
  EXPECT_NE(silhouetteMismatch(evaluation)->find("43 %"), std::string::npos);
}

TEST(Evaluate, FrontLitIsWhenLightAndCameraStandOnOneSide) {
  const PackedStudio packed(testStudio(), 300);
  for (const FrameScore& frame : evaluated(packed.model, packed.capture, ofTraining()).frames) {
    const Vec3<double> camera = studio::spiral(9)[static_cast<size_t>(std::stoi(frame.camera.substr(1)))];
    const Vec3<double> light = studio::spiral(12)[static_cast<size_t>(std::stoi(frame.light.substr(1)))];
    if (std::abs(camera.dot(light)) > 0.05) {
      EXPECT_EQ(frame.frontLit, camera.dot(light) > 0);
    }
  }
}

TEST(Evaluate, AnEmptySplitIsSaid) {
  const PackedStudio packed(testStudio(), 300);
  const std::string line = image::errorOf([&] { evaluated(packed.model, packed.capture); });
  EXPECT_NE(line.find("frames: found none, expected test frames"), std::string::npos) << line;
}

TEST(Evaluate, FramesWithoutAnObjectHaveNoScore) {
  Studio studio = testStudio();
  studio.matte = false;
  PackedStudio packed(studio, 300);
  for (capture::View& view : packed.capture.views) // the object is far aside
    view.camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(1e4, 0, -10)};
  const std::string line = image::errorOf([&] { evaluated(packed.model, packed.capture, ofTraining()); });
  EXPECT_NE(line.find("frames: no pixel of an object"), std::string::npos) << line;
}

} // namespace

} // namespace surflect::evaluation
