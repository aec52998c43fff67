#include "render/stage/stage_file.h"

#include "tests/render/stage/stage_example.h"
#include "tests/render/stage/stages.h"

#include <cmath>
#include <random>

namespace surflect::stage {
namespace {

using namespace stage_example;

TEST(StageFile, SaysWhatStandsWhere) {
  const Stage stage = parse(example);
  EXPECT_EQ(stage.trace.transport, Transport::local);
  EXPECT_EQ(stage.trace.samples, 12);
  EXPECT_EQ(stage.trace.seed, 7u);
  EXPECT_EQ(stage.rig.views.size(), 15u);
  EXPECT_EQ(stage.rig.trainingViews, 12u);
  EXPECT_EQ(stage.rig.lights.size(), 10u);
  EXPECT_EQ(stage.rig.trainingLights, 8u);
  for (const capture::View& view : stage.rig.views) {
    const auto middle = view.camera.project({0, 0, 0.5});
    EXPECT_NEAR(middle->x, 20, 1e-9);
    EXPECT_NEAR(length(view.camera.center() - StagePoint(0, 0, 0.5)), 5, 1e-9);
    // A point fov/2 above the axis is on the upper border.
    EXPECT_NEAR(view.camera.lens.focalY * std::tan(Angle::fromDegrees(15).radians()), 15, 1e-9);
  }
  for (const capture::Light& light : stage.rig.lights)
    EXPECT_EQ(std::get<capture::DirectionalLight>(light.kind).irradiance, (Rgb{3, 2, 1}));
  ASSERT_EQ(stage.objects.size(), 2u);
  EXPECT_EQ(std::get<material::RoughDiffuse>(stage.objects[0].material).roughness, 0.5);
  EXPECT_TRUE(material::isSpecular(stage.objects[1].material));
}

TEST(StageFile, TransportsHaveTheirNames) {
  EXPECT_EQ(parse(with("\"local\"", "\"direct\"")).trace.transport, Transport::direct);
  EXPECT_EQ(parse(with("\"local\"", "\"full\"")).trace.transport, Transport::full);
  EXPECT_EQ(parse(with("transport", "matte = \"transmittance\"\ntransport")).trace.matte,
            Matte::transmittance);
  EXPECT_EQ(parse(with("transport", "matte = \"coverage\"\ntransport")).trace.matte, Matte::coverage);
}

TEST(StageFile, AScaleReplacesWhatItNames) {
  const std::string text =
      with("samples = 12", "samples = 12\nsegments = 8", with("segments = 16", "", example)) + R"toml(
[scale.tiny]
samples = 3
segments = 4
camera.size = [10, 8]
lights = { count = 5 }
[scale.full]
)toml";
  const Stage whole = parse(text), tiny = parseStage(text, "stage.toml", "tiny"),
              full = parseStage(text, "stage.toml", "full");
  EXPECT_EQ(whole.trace.samples, 12);
  EXPECT_EQ(tiny.trace.samples, 3);
  EXPECT_EQ(tiny.rig.views[0].camera.lens.width, 10);
  EXPECT_EQ(tiny.rig.views.size(), whole.rig.views.size());
  EXPECT_EQ(tiny.rig.trainingLights, 5u);
  EXPECT_EQ(tiny.rig.lights.size(), 7u); // the test's two stay
  EXPECT_LT(tiny.objects[0].surface.mesh.triangles.size(), whole.objects[0].surface.mesh.triangles.size());
  EXPECT_EQ(full.rig.lights.size(), whole.rig.lights.size());
  EXPECT_NE(tiny.hash, full.hash);
  const auto error = [&](const std::string& stage, const char* scale) {
    return image::errorOf([&] { parseStage(stage, "stage.toml", scale); });
  };
  EXPECT_EQ(error(text, "tyny"), "stage.toml: scale.tyny: missing, expected full, tiny; did you mean tiny?");
  EXPECT_EQ(error(example, "tiny"), "stage.toml: scale.tiny: missing");
  EXPECT_NE(error(with("camera.size", "camera.siz", text), "tiny").find("camera.siz: unknown key on line"),
            std::string::npos);
  EXPECT_NE(error(with("samples = 3", "samples = 0", text), "tiny").find("samples: found 0 on line 4"),
            std::string::npos)
      << error(with("samples = 3", "samples = 0", text), "tiny");
  // A scale may try to replace scales; it is out of their reach then.
  EXPECT_EQ(parseStage(with("samples = 3", "samples = 3\nscale.tiny = 5", text), "stage.toml", "tiny")
                .trace.samples,
            3);
}

// Returns whether the text is a stage; otherwise checks that its error is one line.
bool isStage(const std::string& text) {
  try {
    parse(text);
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return false;
  }
}

TEST(StageFile, EveryPrefixIsAStageOrAnError) {
  for (size_t length = 0; length < example.find("[[object]]"); ++length)
    EXPECT_FALSE(isStage(example.substr(0, length))) << length;
  for (size_t length = example.find("[[object]]"); length < example.size(); ++length)
    isStage(example.substr(0, length)); // of one object it may be
}

TEST(StageFile, WhateverIsChangedItIsAStageOrAnError) {
  std::mt19937 random(5);
  size_t stages = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    std::string text = example;
    const size_t place = random() % text.size();
    switch (random() % 3) {
    case 0:
      text[place] = static_cast<char>(' ' + random() % 95);
      break;
    case 1:
      text.erase(place, 1 + random() % 8);
      break;
    default:
      if (const size_t digit = text.find_first_of("0123456789", place); digit != text.npos)
        text[digit] = static_cast<char>('0' + random() % 10);
    }
    stages += isStage(text);
  }
  EXPECT_GT(stages, 10u);
  EXPECT_LT(stages, 900u);
}

TEST(StageFile, TheHashIsThatOfTheText) {
  EXPECT_EQ(parse(example).hash, parse(example).hash);
  EXPECT_NE(parse(example).hash, parse(with("seed = 7", "seed = 8")).hash);
}

} // namespace
} // namespace surflect::stage
