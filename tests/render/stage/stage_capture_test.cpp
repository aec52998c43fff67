#include "render/stage/stage_capture.h"
#include "srf/capture/photograph.h"
#include "surfel/base/file.h"
#include "tests/render/stage/stages.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

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
} // namespace surflect::stage
