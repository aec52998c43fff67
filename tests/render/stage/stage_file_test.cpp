#include "render/stage/stage_file.h"
#include "srf/image/png.h"
#include "tests/render/stage/stages.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

const std::string example = R"toml(
transport = "local"
samples = 12
seed = 7
center = [0, 0, 0.5]
[camera]
model = "pinhole"
size = [40, 30]
distance = 5
fov_deg = 30
[views]
turntable = 6
elevations_deg = [-20, 40]
test = 3
[lights]
count = 8
test = 2
irradiance = [3, 2, 1]
[[material]]
name = "clay"
type = "rough_diffuse"
albedo = [0.8, 0.4, 0.2]
roughness = 0.5
[[material]]
name = "steel"
type = "conductor"
color = [0.6, 0.6, 0.5]
alpha = [0, 0]
[[object]]
type = "sphere"
material = "clay"
center = [0, 0, 1]
radius = 0.5
segments = 16
[[object]]
type = "box"
material = "steel"
size = [2, 2, 0.1]
)toml";

// The example with something else in it.
std::string with(const std::string& from, const std::string& to, std::string text = example) {
  const size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("there is no " + from);
  return text.replace(at, from.size(), to);
}

Stage parse(const std::string& text) { return parseStage(text, "stage.toml"); }

void expectError(const std::string& text, const std::vector<std::string>& parts) {
  const std::string line = errorOf([&] { parse(text); });
  EXPECT_EQ(line.rfind("stage.toml: ", 0), 0u) << line;
  for (const std::string& part : parts) EXPECT_NE(line.find(part), std::string::npos) << line;
}

TEST(StageFile, SaysWhatStandsWhere) {
  const Stage stage = parse(example);
  EXPECT_EQ(stage.trace.transport, Transport::local);
  EXPECT_EQ(stage.trace.samples, 12);
  EXPECT_EQ(stage.trace.seed, 7u);
  EXPECT_EQ(stage.rig.views.size(), 15u);
  EXPECT_EQ(stage.rig.trainingViews, 12u);
  EXPECT_EQ(stage.rig.lights.size(), 10u);
  EXPECT_EQ(stage.rig.trainingLights, 8u);
  for (const View& view : stage.rig.views) {
    const auto middle = view.camera.project({0, 0, 0.5});
    EXPECT_NEAR(middle->x, 20, 1e-9);
    EXPECT_NEAR(length(view.camera.center() - StagePoint(0, 0, 0.5)), 5, 1e-9);
    // A point fov/2 above the axis is on the upper border.
    EXPECT_NEAR(view.camera.lens.focalY * std::tan(Angle::fromDegrees(15).radians()), 15, 1e-9);
  }
  for (const Light& light : stage.rig.lights)
    EXPECT_EQ(std::get<DirectionalLight>(light.kind).irradiance, (Rgb{3, 2, 1}));
  ASSERT_EQ(stage.objects.size(), 2u);
  EXPECT_EQ(std::get<RoughDiffuse>(stage.objects[0].material).roughness, 0.5);
  EXPECT_TRUE(isSpecular(stage.objects[1].material));
}

TEST(StageFile, TransportsHaveTheirNames) {
  EXPECT_EQ(parse(with("\"local\"", "\"direct\"")).trace.transport, Transport::direct);
  EXPECT_EQ(parse(with("\"local\"", "\"full\"")).trace.transport, Transport::full);
}

TEST(StageFile, GlassSaysWhatLiesOnItsOtherSide) {
  const std::string media = with("type = \"conductor\"\ncolor = [0.6, 0.6, 0.5]\nalpha = [0, 0]",
                                 "type = \"dielectric\"\neta = 0.9\nabsorption = [1, 2, 3]\n"
                                 "absorption_outside = [4, 5, 6]");
  const auto glass = std::get<Dielectric>(parse(media).objects[1].material);
  EXPECT_EQ(glass.absorption, (Rgb{1, 2, 3}));
  EXPECT_EQ(glass.absorptionOutside, (Rgb{4, 5, 6}));
  expectError(with("[4, 5, 6]", "[4, -5, 6]", media), {"absorption_outside[1]"});
}

TEST(StageFile, TestViewsAndLightsAreNew) {
  const Stage stage = parse(example);
  for (size_t i = stage.rig.trainingLights; i < stage.rig.lights.size(); ++i)
    for (size_t j = 0; j < stage.rig.trainingLights; ++j)
      EXPECT_LT(dot(std::get<DirectionalLight>(stage.rig.lights[i].kind).towards,
                    std::get<DirectionalLight>(stage.rig.lights[j].kind).towards),
                0.999);
  for (size_t i = stage.rig.trainingViews; i < stage.rig.views.size(); ++i)
    for (size_t j = 0; j < stage.rig.trainingViews; ++j)
      EXPECT_GT(length(stage.rig.views[i].camera.center() - stage.rig.views[j].camera.center()), 0.05);
}

TEST(StageFile, LightsAtADistanceGiveTheSameIrradianceAtTheCentre) {
  const Stage stage = parse(with("irradiance", "distance = 4\nirradiance"));
  for (const Light& light : stage.rig.lights) {
    const Rgb irradiance = irradianceAt(light, {0, 0, 0.5});
    EXPECT_NEAR(irradiance.r, 3, 1e-5);
    EXPECT_NEAR(irradiance.b, 1, 1e-5);
  }
}

TEST(StageFile, OrthographicCamerasHaveAHeight) {
  const Stage stage = parse(with("pinhole", "orthographic", with("fov_deg = 30", "height = 2")));
  EXPECT_EQ(stage.rig.views[0].camera.lens.model, Lens::Model::orthographic);
  EXPECT_NEAR(stage.rig.views[0].camera.project(StagePoint(0, 0, 0.5))->y, 15, 1e-9);
  EXPECT_NEAR(stage.rig.views[0].camera.lens.focalY, 15, 1e-12);
}

TEST(StageFile, MaterialsRefuseWhatIsOutOfRange) {
  expectError(with("roughness = 0.5", "roughness = -0.5"), {"material[0].roughness", "-0.5", "line"});
  expectError(with("alpha = [0, 0]", "alpha = -0.1"), {"material[1].alpha", "-0.1"});
  expectError(with("alpha = [0, 0]", "alpha = [0.1, -0.1]"), {"material[1].alpha[1]", "-0.1"});
  expectError(with("0.8, 0.4, 0.2", "0.8, nan, 0.2"), {"material[0].albedo[1]", "nan"});
  expectError(with("0.8, 0.4, 0.2", "0.8, 1.4, 0.2"), {"material[0].albedo[1]", "1.4"});
  expectError(with("\"rough_diffuse\"", "\"velvet\""), {"material[0].type", "velvet", "lambert"});
  expectError(with("roughness = 0.5", "rougness = 0.5"), {"rougness", "nearest", "roughness"});
  expectError(with("\"steel\"", "\"clay\""), {"material[1].name", "clay"});
  const std::string metal = "type = \"conductor\"\ncolor = [0.6, 0.6, 0.5]\nalpha = [0, 0]";
  expectError(with(metal, "type = \"dielectric\"\neta = 1"), {"material[1].eta"});
  expectError(with(metal, "type = \"clear_coat\"\neta = 1.5\nbase = \"clai\""), {"material[1].base", "clay"});
  expectError(with(metal, "type = \"ward\"\ndiffuse = [1,1,1]\nspecular = [1,1,1]\nalpha = 0.1"),
              {"material[1].diffuse + specular"});
  EXPECT_NE(errorOf([&] {
              parse(with(metal, "type = \"measured\"\nfile = \"nothing.binary\""));
            }).find("nothing.binary"),
            std::string::npos);
}

TEST(StageFile, GlassCannotBeCoated) {
  const std::string metal = "type = \"conductor\"\ncolor = [0.6, 0.6, 0.5]\nalpha = [0, 0]";
  const std::string text = with(metal, "type = \"clear_coat\"\neta = 1.5\nbase = \"clay\"");
  parse(text);
  const std::string clay = "type = \"rough_diffuse\"\nalbedo = [0.8, 0.4, 0.2]\nroughness = 0.5";
  expectError(with(clay, "type = \"dielectric\"\neta = 1.5", text),
              {"material[1].base", "clay", "dielectric"});
}

TEST(StageFile, ObjectsRefuseWhatIsNotThere) {
  expectError(with("material = \"clay\"", "material = \"clax\""), {"object[0].material", "clax", "clay"});
  expectError(with("radius = 0.5", "radius = 0"), {"object[0].radius"});
  expectError(with("segments = 16", "segments = 100000"), {"object[0].segments", "100000"});
  expectError(with("size = [2, 2, 0.1]", "size = [2, -2, 0.1]"), {"object[1].size"});
  const TemporaryFolder folder;
  const auto meshAt = [&](const std::string& name) {
    return with("type = \"sphere\"\nmaterial = \"clay\"\ncenter = [0, 0, 1]\nradius = 0.5\nsegments = 16",
                "type = \"mesh\"\nmaterial = \"clay\"\nfile = \"" + (folder / name).string() + "\"");
  };
  const auto error = [&](const std::string& name) { return errorOf([&] { parse(meshAt(name)); }); };
  EXPECT_NE(error("missing.obj").find("missing.obj"), std::string::npos);
  writeBytes(folder / "nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(error("nan.obj").find("nan.obj"), std::string::npos);
  EXPECT_NE(error("nan.obj").find("line 2"), std::string::npos) << error("nan.obj");
  writeBytes(folder / "good.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Stage one = parse(meshAt("good.obj"));
  writeBytes(folder / "good.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
  EXPECT_NE(one.hash, parse(meshAt("good.obj")).hash); // a stage is what its files hold
}

TEST(StageFile, TexturesAreFoundAndCounted) {
  const TemporaryFolder folder;
  const auto textured = [&](const std::string& more) {
    return with("roughness = 0.5",
                "roughness = 0.5\ntexture = \"" + (folder / "cloth.png").string() + "\"\n" + more);
  };
  EXPECT_NE(errorOf([&] { parse(textured("")); }).find("cloth.png"), std::string::npos);
  writePng(folder / "cloth.png", Image(4, 4, 3));
  const Stage stage = parse(textured("repeat = [3, 2]"));
  EXPECT_TRUE(stage.objects[0].texture);
  EXPECT_FALSE(stage.objects[1].texture);
  expectError(textured("repeat = [3, 0]"), {"material[0].repeat[1]"});
  expectError(with("roughness = 0.5", "roughness = 0.5\nrepeat = [3, 1]"), {"material[0].repeat"});
  writeBytes(folder / "flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expectError(with("type = \"sphere\"\nmaterial = \"clay\"\ncenter = [0, 0, 1]\nradius = 0.5\nsegments = 16",
                   "type = \"mesh\"\nmaterial = \"clay\"\nfile = \"" + (folder / "flat.obj").string() + "\"",
                   textured("")),
              {"object[0].material", "texture coordinates"});
  writePng(folder / "cloth.png", Image(4, 5, 3));
  EXPECT_NE(parse(textured("repeat = [3, 2]")).hash, stage.hash);
}

TEST(StageFile, ARigNeedsViewsAndLights) {
  expectError(with("[lights]\ncount = 8\ntest = 2\nirradiance = [3, 2, 1]", ""), {"lights", "missing"});
  expectError(with("count = 8", "count = 0"), {"lights.count", "0"});
  expectError(with("irradiance = [3, 2, 1]", "irradiance = [3, 0, 1]"), {"lights.irradiance[1]"});
  expectError(with("irradiance", "distance = 3\nradius_deg = 2\nirradiance"), {"lights.radius_deg"});
  expectError(with("elevations_deg = [-20, 40]", "elevations_deg = []"), {"views.elevations_deg"});
  expectError(with("elevations_deg = [-20, 40]", "elevations_deg = [-20, 95]"), {"views.elevations_deg[1]"});
  expectError(with("turntable = 6", "count = 5\nturntable = 6"), {"views.turntable"});
  expectError(with("fov_deg = 30", "height = 3"), {"camera.height"});
  expectError(with("size = [40, 30]", "size = [16384, 16384]"), {"camera.size"});
  expectError(with("samples = 12", "samples = 0"), {"samples"});
  expectError(with("\"local\"", "\"global\""), {"transport", "global"});
}

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

TEST(StageFile, RoughMaterialsHaveTheirTables) {
  const Stage stage = parse(with("alpha = [0, 0]", "alpha = 0.3"));
  requireValid(stage.objects[1].material);
  EXPECT_TRUE(std::get<Conductor>(stage.objects[1].material).mirrorLoss);
}

} // namespace
} // namespace surflect
