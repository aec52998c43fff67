#include "render/stage/stage_pictures.h"

#include "srf/capture/photograph.h"
#include "srf/model/model.h"
#include "surfel/base/file.h"
#include "tests/render/stage/stages.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <map>

namespace surflect::stage {

namespace {

const std::string text = ballOnSlab(4, "size = [12, 10]", "turntable = 3\nelevations_deg = [20]\ntest = 2",
                                    "count = 3\ntest = 1\nirradiance = [3, 3, 3]");

Stage smallStage() { return parseStage(text, "stage.toml"); }

TEST(StageCapture, ReadsBackAsItWasTraced) {
  const image::TemporaryFolder folder;
  const StageReport report = captureStage(smallStage(), nullptr, StageFrames::all, folder / "c", {});
  EXPECT_EQ(report.trainingFrames, 9u);
  EXPECT_EQ(report.testFrames, 11u);
  const capture::Capture capture = capture::readCapture(folder / "c");
  ASSERT_EQ(capture.frames.size(), 20u);
  ASSERT_EQ(capture.views.size(), 5u);
  EXPECT_EQ(capture.lights, smallStage().rig.lights);
  const StageScene scene(smallStage().objects);
  for (size_t v = 0; v < 5; ++v) {
    const TracedView traced = traceView(scene, smallStage().rig.views[v].camera, v, smallStage().rig.lights,
                                        smallStage().trace, {});
    for (size_t i = 0; i < capture.frames.size(); ++i) {
      if (capture.views[capture.frames[i].view].identity != smallStage().rig.views[v].identity) continue;
      const size_t light = *capture.frames[i].light;
      EXPECT_EQ(capture.frames[i].split, v < 3 && light < 3 ? capture::Split::train : capture::Split::test);
      const std::vector<size_t> one{i};
      const capture::Photograph photograph = capture::readPhotographs(capture, one, {})[0];
      for (size_t p = 0; p < traced.alpha.values.size(); ++p) {
        EXPECT_EQ(photograph.alpha.values[p], traced.alpha.values[p]); // quarters fit a half float
        for (size_t c = 0; c < 3 && traced.alpha.values[p] > 0; ++c) {
          const float value = traced.radiance[light].values[3 * p + c];
          EXPECT_NEAR(photograph.radiance.values[3 * p + c], value, 2e-3 * value + 1e-6);
        }
      }
    }
  }
}

TEST(StageCapture, BrighterThanHalfFloatsIsKept) {
  const image::TemporaryFolder folder;
  const Stage sunny = parseStage(replaced(text, "[3, 3, 3]", "[1e6, 1e6, 1e6]"), "stage.toml");
  captureStage(sunny, nullptr, StageFrames::all, folder / "c", {});
  const capture::Capture capture = capture::readCapture(folder / "c");
  const std::vector<size_t> one{1};
  const capture::Photograph photograph = capture::readPhotographs(capture, one, {})[0];
  const auto& values = photograph.radiance.values;
  EXPECT_GT(*std::ranges::max_element(values), 65504.f);
  EXPECT_LT(*std::ranges::max_element(values), 1e6f);
}

TEST(StageCapture, TheGeometryIsTheMeshToTheBit) {
  const image::TemporaryFolder folder;
  captureStage(smallStage(), nullptr, StageFrames::all, folder / "c", {});
  const TriangleMesh mesh = readMeshAsStored(folder / "c" / capture::readCapture(folder / "c").geometry);
  std::vector<Point3<AcquisitionSpace>> vertices;
  size_t triangles = 0;
  for (const auto& object : smallStage().objects) {
    const TriangleMesh& part = object.surface.mesh;
    vertices.insert(vertices.end(), part.positions.begin(), part.positions.end());
    triangles += part.triangles.size();
  }
  EXPECT_EQ(mesh.positions, vertices);
  EXPECT_EQ(mesh.triangles.size(), triangles);
}

TEST(StageCapture, AnInterruptedRunGoesOnToTheSameBytes) {
  const image::TemporaryFolder folder;
  captureStage(smallStage(), nullptr, StageFrames::all, folder / "whole", {});
  int calls = 0;
  Progress progress;
  progress.cancelled = [&] {
    return std::filesystem::exists(folder / "part" / "images" / "C001.exr") && ++calls > 3;
  };
  EXPECT_THROW(captureStage(smallStage(), nullptr, StageFrames::all, folder / "part", progress), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder / "part" / "transforms.json"));
  image::writeBytes(folder / "part" / "images" / "C000.exr", "damaged");
  EXPECT_EQ(captureStage(smallStage(), nullptr, StageFrames::all, folder / "part", {}).resumedViews, 1u);
  EXPECT_EQ(image::contentOf(folder / "part"), image::contentOf(folder / "whole"));
}

// Killed before the folder was its own.
TEST(StageCapture, WhatWasLeftOfItsIdentityIsRemoved) {
  const image::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "c");
  writeFileAtomically(folder / "c" / "stage.identity.k3ZxQ1.tmp", "st");
  captureStage(smallStage(), nullptr, StageFrames::all, folder / "c", {});
  EXPECT_FALSE(std::filesystem::exists(folder / "c" / "stage.identity.k3ZxQ1.tmp"));
}

TEST(StageCapture, AnotherStageIsNotMixedIn) {
  const image::TemporaryFolder folder;
  captureStage(smallStage(), nullptr, StageFrames::all, folder / "c", {});
  Stage other = smallStage();
  other.hash ^= 1;
  EXPECT_NE(image::errorOf([&] {
              captureStage(other, nullptr, StageFrames::all, folder / "c", {});
            }).find("another stage"),
            std::string::npos);
  const auto warp = warp::chainWarp({});
  const StageDeformation deformation{*warp, 5};
  EXPECT_NE(image::errorOf([&] {
              captureStage(smallStage(), &deformation, StageFrames::deformed, folder / "c", {});
            }).find("another stage"),
            std::string::npos);
  std::filesystem::create_directory(folder / "mine");
  image::writeBytes(folder / "mine" / "letter.txt", "dear");
  EXPECT_NE(image::errorOf([&] {
              captureStage(smallStage(), nullptr, StageFrames::all, folder / "mine", {});
            }).find("something there"),
            std::string::npos);
}

// The identity bends nothing: the test views are those of the plain capture, to the bit.
TEST(StageCapture, TheTruthUnderTheIdentityIsThePlainCapture) {
  const image::TemporaryFolder folder;
  captureStage(smallStage(), nullptr, StageFrames::all, folder / "plain", {});
  const auto warp = warp::chainWarp({});
  const StageDeformation deformation{*warp, 5};
  const StageReport report =
      captureStage(smallStage(), &deformation, StageFrames::deformed, folder / "truth", {});
  EXPECT_EQ(report.views, 2u);
  EXPECT_EQ(report.trainingFrames, 0u);
  EXPECT_EQ(report.testFrames, 8u);
  const auto plain = image::contentOf(folder / "plain"), truth = image::contentOf(folder / "truth");
  for (const char* name : {"images/C003.exr", "images/C004.exr", "geometry.obj"})
    EXPECT_EQ(truth.at(name), plain.at(name)) << name;
}

} // namespace

namespace {

namespace fs = std::filesystem;

double square(double x) { return x * x; }

// Shares of a third do not fit half floats.
Stage stage(const std::string& irradiance = "[3, 3, 3]") {
  return parseStage(ballOnSlab(3, "size = [21, 18]", "turntable = 5\nelevations_deg = [-20, 20]\ntest = 2",
                               "count = 6\ntest = 1\nirradiance = " + irradiance),
                    "stage.toml");
}

model::PackOptions options() {
  model::PackOptions chosen;
  chosen.surfels = 500;
  chosen.tolerance = 0.01;
  chosen.overwrite = true;
  return chosen;
}

class StagePack : public ::testing::Test {
protected:
  model::PackReport packed(const std::string& name, const Stage& what = stage(),
                           const Progress& progress = {}) {
    return packStage(what, folder / name, options(), progress, nullptr);
  }
  image::TemporaryFolder folder;
};

TEST_F(StagePack, IsThePackedCaptureToTheBit) {
  int number = 0;
  for (const char* irradiance : {"[3, 3, 3]", "[1e6, 1e5, 1e6]"}) { // half floats, and single ones
    const std::string capture = "capture" + std::to_string(number), two = "two" + std::to_string(number),
                      one = "one" + std::to_string(number);
    ++number;
    captureStage(stage(irradiance), nullptr, StageFrames::all, folder / capture, {});
    const model::PackReport there =
        model::pack(capture::readCapture(folder / capture), folder / two, options(), {}, nullptr);
    const model::PackReport streamed = packed(one, stage(irradiance));
    EXPECT_EQ(image::modelContentOf(folder / one), image::modelContentOf(folder / two));
    EXPECT_EQ(streamed.white, there.white);
    EXPECT_EQ(streamed.store.squaredError, there.store.squaredError);
    EXPECT_EQ(streamed.views, there.views);
    EXPECT_FALSE(fs::exists(folder / one / "traced"));
  }
}

TEST_F(StagePack, AnInterruptedRunGoesOnToTheSameBytesAndErrors) {
  const model::PackReport whole = packed("whole");
  const std::vector<std::pair<std::string, std::string>> moments = {
      {"traced/images/C001.exr", "survey"}, {"views/survey", "store"}, {"views/0003.srfb", "store"}};
  for (const auto& [file, phase] : moments) {
    const std::string name = "until-" + fs::path(file).filename().string();
    Progress untilThen;
    untilThen.cancelled = [&] { return fs::exists(folder / name / file); };
    EXPECT_THROW(packed(name, stage(), untilThen), Cancelled);
    EXPECT_FALSE(fs::exists(folder / name / "manifest.json"));
    const model::PackReport report = packed(name);
    EXPECT_EQ(report.resumedViews, file == "views/0003.srfb" ? 4u : 0u) << file;
    EXPECT_EQ(image::modelContentOf(folder / name), image::modelContentOf(folder / "whole"));
    EXPECT_EQ(report.store.squaredError, whole.store.squaredError);
    EXPECT_EQ(report.store.clippedSquaredError, whole.store.clippedSquaredError);
    EXPECT_EQ(report.store.values, whole.store.values);
  }
  EXPECT_EQ(packed("whole").resumedViews, 10u);
}

TEST_F(StagePack, AnotherStageStartsAnew) {
  packed("model");
  const model::PackReport other = packed("model", stage("[2, 3, 3]"));
  EXPECT_EQ(other.resumedViews, 0u);
  packed("fresh", stage("[2, 3, 3]"));
  EXPECT_EQ(image::modelContentOf(folder / "model"), image::modelContentOf(folder / "fresh"));
}

TEST_F(StagePack, SurveyedViewsOfAnotherStageAreNotTakenForItsOwn) {
  Progress untilTheSurvey;
  untilTheSurvey.cancelled = [&] { return fs::exists(folder / "model/traced/images/C001.exr"); };
  EXPECT_THROW(packed("model", stage("[2, 3, 3]"), untilTheSurvey), Cancelled);
  packed("model");
  packed("fresh");
  EXPECT_EQ(image::modelContentOf(folder / "model"), image::modelContentOf(folder / "fresh"));
}

// The error of each view, from the stored numbers and the traced ones.
TEST_F(StagePack, TheErrorIsThatOfTheStoredBlocks) {
  const model::PackReport report = packed("model");
  const model::Model model = model::openModel(folder / "model");
  const StageScene scene(stage().objects);
  for (size_t v = 0; v < report.views.size(); ++v) {
    std::vector<capture::Light> lights = stage().rig.lights;
    lights.pop_back(); // that of the test
    const TracedView traced = traceView(scene, stage().rig.views[v].camera, v, lights, stage().trace, {});
    double squared = 0;
    size_t values = 0;
    for (uint32_t b = 0; b < model.files[v].blockCount(); ++b) {
      const codec::Block block = model.files[v].read(b);
      const codec::BlockPosition at = model.files[v].position(b);
      for (int t = 0; t < codec::blockTexels; ++t) {
        if (!(block.present >> t & 1)) continue;
        for (size_t l = 0; l < lights.size(); ++l)
          for (size_t c = 0; c < 3; ++c) {
            double stored = 0;
            for (int k = 0; k < block.stride; ++k)
              stored += block.light(l)[k] * block.texel(t)[static_cast<int>(c) * block.stride + k];
            const double truth = traced.radiance[l].at(at.x * 8 + t % 8, at.y * 8 + t / 8)[c];
            squared += square(std::clamp(stored, 0., report.white) - std::clamp(truth, 0., report.white));
            ++values;
          }
      }
    }
    ASSERT_EQ(values, report.ofView[v].values);
    const double db = 10 * std::log10(report.white * report.white * static_cast<double>(values) / squared);
    EXPECT_NEAR(codec::psnrDb(report.ofView[v], report.white), db, 0.05); // half floats of the traced ones
    EXPECT_GT(db, 30);
  }
}

TEST_F(StagePack, WhatIsKeptForTheTestIsOfTheWholeCapture) {
  captureStage(stage(), nullptr, StageFrames::all, folder / "all", {});
  const StageReport report = captureStage(stage(), nullptr, StageFrames::test, folder / "test", {});
  EXPECT_EQ(report.trainingFrames, 0u);
  EXPECT_EQ(report.testFrames, 2u * 7 + 5u); // of ten training views every second
  const capture::Capture all = capture::readCapture(folder / "all"),
                         test = capture::readCapture(folder / "test");
  EXPECT_EQ(test.lights, all.lights);
  for (size_t i = 0; i < test.frames.size(); ++i) {
    const capture::Frame& frame = test.frames[i];
    const auto same = std::ranges::find_if(all.frames, [&](const capture::Frame& other) {
      return other.picture == frame.picture && other.layer == frame.layer;
    });
    ASSERT_NE(same, all.frames.end());
    EXPECT_EQ(same->split, capture::Split::test);
    EXPECT_EQ(all.views[same->view].camera.cameraFromWorld.rotation(),
              test.views[frame.view].camera.cameraFromWorld.rotation());
    const auto j = static_cast<size_t>(same - all.frames.begin());
    EXPECT_EQ(capture::readPhotographs(test, std::span(&i, 1))[0].radiance.values,
              capture::readPhotographs(all, std::span(&j, 1))[0].radiance.values);
  }
}

TEST_F(StagePack, WithNothingKeptBackThereIsNothingForTheTest) {
  Stage whole = stage();
  whole.rig.views.resize(whole.rig.trainingViews);
  whole.rig.lights.resize(whole.rig.trainingLights);
  EXPECT_NE(image::errorOf([&] {
              captureStage(whole, nullptr, StageFrames::test, folder / "t", {});
            }).find("nothing"),
            std::string::npos);
}

} // namespace

} // namespace surflect::stage
