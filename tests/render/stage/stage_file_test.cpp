#include "render/stage/material_section.h"
#include "render/stage/stage_file.h"
#include "srf/capture/writer.h"
#include "srf/image/png.h"
#include "tests/render/stage/material/zoo.h"
#include "tests/render/stage/stages.h"
#include "tests/render/stage/surfaces.h"
#include "tests/srf/image/files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

TEST(StageFile, MaterialsAreAThousandAtMost) {
  std::string many = example; // of two
  for (int i = 0; i < 998; ++i)
    many += fmt::format("[[material]]\nname = \"m{}\"\ntype = \"lambert\"\nalbedo = [1, 1, 1]\n", i);
  parse(many);
  expectError(many + "[[material]]\nname = \"one\"\ntype = \"lambert\"\nalbedo = [1, 1, 1]\n",
              {"material: ", "found 1001", "at most 1000"});
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

// The example with another first object; lines of its table.
std::string withObject(const std::string& lines) {
  return with("type = \"sphere\"\nmaterial = \"clay\"\ncenter = [0, 0, 1]\nradius = 0.5\nsegments = 16",
              "material = \"clay\"\n" + lines);
}

TEST(StageFile, ShapesStandWhereTheyArePlaced) {
  const Stage stage =
      parse(withObject("type = \"lathe\"\nprofile = [[0.5, -1], [0.5, 1]]\nscale = [1, 1, 0.5]\n"
                       "rotate_axis = [0, 1, 0]\nrotate_deg = 90\nposition = [0, 0, 3]\n"
                       "copies = [{}, { position = [0, 5, 0], scale = [1, -1, 1] }]"));
  Eigen::AlignedBox3f first, second;
  for (const auto& p : stage.objects[0].surface.mesh.positions)
    (p.y() < 2.5 ? first : second).extend(p.raw());
  EXPECT_LT((first.min() - Vec3<float>(-0.5f, -0.5f, 2.5f)).norm(), 1e-5f); // scaled, then turned, then moved
  EXPECT_LT((first.max() - Vec3<float>(0.5f, 0.5f, 3.5f)).norm(), 1e-5f);
  EXPECT_LT((second.min() - Vec3<float>(-0.5f, 4.5f, 2.5f)).norm(), 1e-5f); // and then each copy
}

TEST(StageFile, ARingIsCopiesTurnedRoundZ) {
  const std::string rod = "type = \"tube\"\npoints = [[1, 0, 0], [2, 0, 0]]\nradius = 0.1\nsegments = 8";
  const TriangleMesh one = parse(withObject(rod)).objects[0].surface.mesh,
                     four = parse(withObject(rod + "\nring = 4")).objects[0].surface.mesh;
  ASSERT_EQ(four.positions.size(), 4 * one.positions.size());
  for (size_t i = 0; i < one.positions.size(); ++i) {
    const auto& p = one.positions[i];
    const Vec3<float> turned(-p.y(), p.x(), p.z());
    EXPECT_LT((four.positions[i + one.positions.size()].raw() - turned).norm(), 1e-6f);
  }
}

TEST(StageFile, ShapesRefuseWhatTheyCannotBe) {
  const auto refuse = [](const std::string& lines, const std::vector<std::string>& parts) {
    expectError(withObject(lines), parts);
  };
  const std::string rod = "type = \"tube\"\npoints = [[0, 0, 0], [1, 0, 0]]\nradius = 0.1\n";
  refuse("type = \"lathe\"\nprofile = [[0.5, 0]]", {"object[0].profile", "two points or more"});
  refuse("type = \"lathe\"\nprofile = [[0.5, 0], [-0.5, 1]]", {"object[0].profile[1][0]", "-0.5"});
  refuse("type = \"lathe\"\nprofile = [[0, 0], [0, 1]]", {"object[0].profile", "a point off the axis"});
  refuse("type = \"lathe\"\nprofile = [[1, 0, 3], [0, 1]]", {"object[0].profile[0]", "[radius, height]"});
  refuse("type = \"lathe\"\nprofile = [[1, 0], [1, 0], [1, 1]]", {"object[0].profile[0]", "between creases"});
  refuse("type = \"tube\"\npoints = [[0, 0, 0]]\nradius = 0.1", {"object[0].points", "2 points or more"});
  refuse("type = \"tube\"\npoints = [[0, 0, 0], [0, 0, 0]]\nradius = 0.1",
         {"object[0].points[1]", "the same"});
  refuse("type = \"tube\"\npoints = [[0, 0, 0], [1, 0, 0]]\nradius = [0.1]", {"object[0].radius", "as many"});
  refuse("type = \"tube\"\npoints = [[0, 0, 0], [1, 0, 0]]\nradius = [0, 0]",
         {"object[0].radius", "above 0"});
  refuse("type = \"tube\"\npoints = [[0, 0, 0], [1, 0, 0]]\nradius = [0.1, -1]",
         {"object[0].radius[1]", "-1"});
  refuse("type = \"braid\"\npoints = [[0, 0, 0], [1, 0, 0]]\nradius = 0.1\nturns = 0",
         {"object[0].turns", "0"});
  refuse("type = \"braid\"\npoints = [[0, 0, 0], [1, 0, 0]]\nradius = 0.1\nturns = 10000\nfibres = 1000",
         {"object[0].points", "triangles"});
  std::string many = "type = \"tube\"\nradius = 1\npoints = [";
  for (int i = 0; i < 10'001; ++i) many += "[0, 0, 0],";
  refuse(many + "]", {"object[0].points", "at most 10000 points"});
  const std::string skin = "on = { type = \"sphere\", radius = 1, segments = 8 }\n";
  refuse("type = \"fur\"\nhairs = 10\nlength = 0.1\nradius = 0.01", {"object[0].on", "missing"});
  refuse("type = \"fur\"\nhairs = 0\nlength = 0.1\nradius = 0.01\n" + skin, {"object[0].hairs", "0"});
  refuse("type = \"fur\"\nhairs = 10\nlength = 0.1\nradius = 0.01\ndisorder = 2\n" + skin,
         {"object[0].disorder", "2"});
  refuse("type = \"fur\"\nhairs = 1000000\nlength = 0.1\nradius = 0.01\n" + skin,
         {"object[0].hairs", "triangles"});
  refuse("type = \"fur\"\nhairs = 1\nlength = 1\nradius = 1\non = { type = \"spere\" }",
         {"object[0].on.type", "spere", "sphere"});
  refuse(rod + "displace = \"cos(q)\"", {"object[0].displace", "q"});
  refuse(rod + "displace = \"1/(x-x)\"", {"object[0].displace.vertex[0]", "no value"});
  refuse(rod + "fibre_deg = 400", {"object[0].fibre_deg", "400"});
  refuse(rod + "scale = [1, 0, 1]", {"object[0].scale"});
  refuse(rod + "rotate_axis = [0, 0, 0]\nrotate_deg = 10", {"object[0].rotate_axis"});
  refuse(rod + "rotate_axis = [0, 0, 1]", {"object[0].rotate_axis", "rotate_deg"});
  refuse(rod + "copies = []", {"object[0].copies", "one copy"});
  refuse(rod + "copies = [{ postion = [0, 0, 0] }]", {"object[0].copies[0].postion", "position"});
  refuse(rod + "ring = 0", {"object[0].ring", "0"});
  refuse(rod + "segments = 256\nring = 100000", {"object[0].ring", "triangles"});
}

TEST(StageFile, ObjectsRefuseToBeNothing) {
  const auto refuse = [](const std::string& lines, const std::vector<std::string>& parts) {
    expectError(withObject(lines), parts);
  };
  const auto ball = [](const std::string& center, const std::string& radius) {
    return "type = \"sphere\"\ncenter = " + center + "\nradius = " + radius + "\nsegments = 8\n";
  };
  // As the skin of fur.
  const auto skin = [](const std::string& table) {
    return "type = \"fur\"\nhairs = 10\nlength = 0.1\nradius = 0.01\non = { " + table + " }";
  };
  const std::string far = "type = \"sphere\", center = [1e9, 1e9, 1e9], radius = 1e-3, segments = 8",
                    large = "type = \"sphere\", radius = 1e9, segments = 8, scale = 1e6";
  const std::string nothing = "no triangle that has an area";
  refuse(ball("[1e9, 1e9, 1e9]", "1e-3"), {"object[0]: ", nothing});
  refuse(skin(far), {"object[0].on: ", nothing});
  refuse(ball("[0, 0, 0]", "1") + "displace = \"0*x-1\"", {"object[0].displace: ", "0*x-1", "millionth"});
  refuse(ball("[0, 0, 1]", "1e-9") + "scale = 1e-6\ncopies = [{ scale = 1e-6, position = [1, 0, 0] }]",
         {"object[0]: ", nothing});
  const std::string within = "within 1e9";
  refuse(ball("[1e9, 0, 0]", "1e9"), {"object[0]: ", within});
  refuse(skin(large), {"object[0].on: ", within, "1e+15"});
  refuse(skin("type = \"fur\", hairs = 3, length = 1e9, radius = 1e9, on = { " + large + " }"),
         {"object[0].on.on: ", within});
  // 1e9 of a height thrice scaled is more than a float holds.
  refuse("type = \"fur\"\nhairs = 3\nlength = 1e9\nradius = 1\ncomb = [1e9, 1e9, 1e9]\nscale = 1e6\n"
         "displace = \"999999999\"\ncopies = [{ scale = [1e6, -1e6, 1e6] }, { scale = 1e6 }]\n"
         "on = { type = \"sphere\", radius = 1, segments = 8 }",
         {"object[0]: ", within});
  // What is flat in part, or thin, stays.
  parse(withObject(ball("[0, 0, 0]", "1") + "displace = \"0*x-0.99\""));
  EXPECT_GT(parse(withObject(ball("[1e6, 0, 0]", "1"))).objects[0].surface.mesh.triangles.size(), 0u);
}

TEST(StageFile, TheInterfacesOfTheMugCloseWhatTheyHold) {
  const std::filesystem::path path =
      std::filesystem::path(__FILE__).parent_path() / "../../../examples/stages/mug.toml";
  const Stage stage = readStage(path, "tiny");
  ASSERT_EQ(stage.objects.size(), 4u);
  const auto hold = [&](const std::vector<size_t>& indices) {
    Surface surface;
    for (const size_t i : indices) append(surface, stage.objects[i].surface);
    EXPECT_TRUE(isClosed(surface.mesh));
    return volumeOf(surface.mesh);
  };
  // Glass with beer in it has the surfaces towards air.
  const double mug = hold({0, 2}), beer = hold({1, 2}), handle = hold({3});
  EXPECT_GT(mug, beer); // all point outwards
  EXPECT_GT(beer, 0);
  EXPECT_GT(handle, 0);
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
    return errorOf([&] { parseStage(stage, "stage.toml", scale); });
  };
  EXPECT_EQ(error(text, "tyny"), "stage.toml: scale.tyny: missing; the nearest one there is tiny");
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

TEST(StageFile, WhatMaterialsShareIsReadOnce) {
  const TemporaryFolder folder;
  writePng(folder / "cloth.png", Image(4, 4, 3));
  writeBytes(folder / "gloss.binary", zoo::merlFile([](double, double, double) {
               return std::array{0.1, 0.1, 0.1};
             }));
  std::string text;
  for (const char* name : {"a", "b"})
    text += fmt::format("[[material]]\nname = \"{0}\"\ntype = \"measured\"\nfile = \"gloss.binary\"\n"
                        "[[material]]\nname = \"cloth {0}\"\ntype = \"lambert\"\nalbedo = [1, 1, 1]\n"
                        "texture = \"cloth.png\"\nrepeat = [{1}, 1]\n",
                        name, name[0] - 'a' + 1);
  const ScriptDocument document(text, folder / "stage.toml");
  const MaterialList list = asMaterials(Section(document.root(), {"material"}).require("material"));
  EXPECT_EQ(list.files, (std::vector{folder / "gloss.binary", folder / "cloth.png"}));
  const auto table = [&](const char* name) {
    return std::get<Measured>(list.materials.find(name)->second.material).table;
  };
  EXPECT_TRUE(table("a"));
  EXPECT_EQ(table("a"), table("b"));
  EXPECT_NE(list.materials.find("cloth a")->second.texture, list.materials.find("cloth b")->second.texture);
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
  const auto rigOf = [](int views, int lights) {
    return with("turntable = 6\nelevations_deg = [-20, 40]\ntest = 3", fmt::format("count = {}", views),
                with("count = 8\ntest = 2", fmt::format("count = {}\ntest = 0", lights)));
  };
  EXPECT_EQ(parse(rigOf(1000, 4000)).rig.views.size(), 1000u);
  expectError(rigOf(1000, 4001), {"views: ", "at most 4000000", "1000 views", "4001 lights"});
  expectError(rigOf(100'000, 4096), {"views: ", "at most 4000000", "100000 views"});
}

const std::string kTurntable = "turntable = 6\nelevations_deg = [-20, 40]\ntest = 3\n";
const std::string kCount = "count = 8\ntest = 2\n";

TEST(StageFile, ViewsAndLightsStandWhereListsSay) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> degrees(-89, 89);
  const StagePoint center(0, 0, 0.5);
  std::string angles, directions, positions;
  std::vector<StageDirection> expected;
  for (int i = 0; i < 7; ++i) {
    const double azimuth = 2 * degrees(random), elevation = degrees(random);
    const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
    const StageDirection d(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
    expected.push_back(d);
    const char* comma = i < 5 ? ", " : i == 5 ? "]\ntest = [" : ", ";
    const auto append = [&](std::string& list, const std::string& element) {
      list += (list.empty() ? "[" : comma) + element;
    };
    append(angles, fmt::format("[{:.17g}, {:.17g}]", azimuth, elevation));
    append(directions, fmt::format("[{:.17g}, {:.17g}, {:.17g}]", 3 * d.x(), 3 * d.y(), 3 * d.z()));
    append(positions, fmt::format("[{:.17g}, {:.17g}, {:.17g}]", 5 * d.x(), 5 * d.y(), 0.5 + 5 * d.z()));
  }
  const std::vector<std::pair<std::string, std::string>> lists = {
      {"angles_deg", angles}, {"directions", directions}, {"positions", positions}};
  for (const auto& [key, list] : lists) {
    const std::string section = key + " = " + list + "]\n";
    std::string text = with(kTurntable, section, with(kCount, section));
    if (key == "positions") text = with("distance = 5\n", "", text);
    const Stage stage = parse(text);
    EXPECT_EQ(stage.rig.trainingViews, 5u);
    EXPECT_EQ(stage.rig.trainingLights, 5u);
    ASSERT_EQ(stage.rig.views.size(), 7u);
    ASSERT_EQ(stage.rig.lights.size(), 7u);
    for (size_t i = 0; i < 7; ++i) {
      const auto& camera = stage.rig.views[i].camera;
      EXPECT_LT(length(camera.center() - (center + 5. * expected[i])), 1e-9) << key;
      EXPECT_NEAR(camera.project(center)->x, 20, 1e-9);
      EXPECT_NEAR(camera.project(center)->y, 15, 1e-9);
      const Light& light = stage.rig.lights[i];
      EXPECT_LT(length(towardsLight(light, center) + -expected[i]), 1e-9) << key;
      EXPECT_NEAR(irradianceAt(light, center).g, 2, 1e-5);
      EXPECT_EQ(std::holds_alternative<PointLight>(light.kind), key == "positions");
    }
  }
}

TEST(StageFile, ListsRefuseWhatIsNoPlace) {
  const auto views = [](const std::string& list) { return with(kTurntable, list + "\n"); };
  const auto lights = [](const std::string& list) { return with(kCount, list + "\n"); };
  expectError(views("directions = [[1, 0, 0], [0, 0, 0]]"), {"views.directions[1]", "not 0"});
  expectError(views("directions = [[1, 0, 0], [0, nan, 1]]"), {"views.directions[1][1]", "nan"});
  expectError(views("directions = []"), {"views.directions", "1 to"});
  expectError(views("directions = [[1, 0]]"), {"views.directions[0]", "3 numbers"});
  expectError(views("directions = [[1, 0, 0]]\ntest = 3"), {"views.test"});
  expectError(views("directions = [[1, 0, 0]]\ntest = [[1]]"), {"views.test[0]"});
  expectError(views("directions = [[1, 0, 0]]\ncount = 3"), {"views.directions", "beside count"});
  expectError(views("directions = [[1, 0, 0]]\nelevations_deg = [3]"), {"views.elevations_deg"});
  expectError(views("angles_deg = [[1, 91]]"), {"views.angles_deg[0][1]", "91"});
  expectError(views("angles_deg = [[1]]"), {"views.angles_deg[0]", "azimuth"});
  expectError(views("positions = [[0, 0, 3]]"), {"camera.distance", "positions"});
  expectError(with("distance = 5\n", ""), {"camera.distance", "missing"});
  expectError(with("distance = 5\n", "", views("positions = [[0, 0, 0.5]]")),
              {"views.positions[0]", "centre"});
  expectError(lights("positions = [[0, 0, 3]]\nradius_deg = 1"), {"lights.radius_deg"});
  expectError(lights("positions = [[0, 0, 3]]\ndistance = 1"), {"lights.distance"});
  expectError(with(kTurntable, ""), {"views.count", "missing"});
}

TEST(StageFile, AnotherCapturesRigCanBeTaken) {
  const TemporaryFolder folder;
  const Stage first = parse(example);
  Capture capture;
  capture.lights = first.rig.lights;
  for (size_t v = 0; v < 3; ++v) { // the second for the test
    capture.views.push_back({v == 2 ? "left" : fmt::format("C{}", v), first.rig.views[4 * v].camera});
    for (size_t l = 0; l < capture.lights.size(); ++l) {
      Frame frame;
      frame.view = v;
      frame.light = l;
      frame.picture = "gone.exr";
      frame.split = v == 1 || l == 0 ? Split::test : Split::train;
      capture.frames.push_back(frame);
    }
  }
  writeCapture(capture, folder.path());
  const std::string from = "from = \"" + folder.path().string() + "\"\n";
  const std::string camera = "[camera]\nmodel = \"pinhole\"\nsize = [40, 30]\ndistance = 5\nfov_deg = 30\n";
  const std::string text =
      with(camera, "", with(kTurntable, from, with(kCount + "irradiance = [3, 2, 1]\n", from)));
  const Stage stage = parse(text);
  ASSERT_EQ(stage.rig.views.size(), 3u);
  EXPECT_EQ(stage.rig.trainingViews, 2u);
  EXPECT_EQ(stage.rig.views[1].identity, "left");
  EXPECT_EQ(stage.rig.views[2].identity, "C1");
  EXPECT_EQ(stage.rig.views[1].camera.lens, first.rig.views[0].camera.lens);
  EXPECT_LT(length(stage.rig.views[1].camera.center() - first.rig.views[8].camera.center()), 1e-12);
  EXPECT_EQ(stage.rig.trainingLights, 9u);
  EXPECT_EQ(stage.rig.lights[0], first.rig.lights[1]);
  EXPECT_EQ(stage.rig.lights[9], first.rig.lights[0]);

  // The capture counts as part of the stage.
  capture.lights[3].kind = PointLight{{1, 2, 3}, {4, 5, 6}};
  capture.lights[3].identity = "cluster";
  writeCapture(capture, folder.path());
  EXPECT_NE(parse(text).hash, stage.hash);
  EXPECT_EQ(parse(text).rig.lights[2], capture.lights[3]);
  // Names that no file could have are replaced by numbers.
  capture.views[2].identity = "../left";
  writeCapture(capture, folder.path());
  EXPECT_EQ(parse(text).rig.views[1].identity, "C001");

  expectError(with(kTurntable, from), {"camera", "views.from"});
  expectError(with(kCount, from), {"lights.irradiance", "from"});
  const std::string disc = with("irradiance = [3, 2, 1]\n", "radius_deg = 2\n", with(kCount, from));
  EXPECT_NEAR(parse(disc).rig.lightRadius.degrees(), 2, 1e-12); // some are directional
  Capture points = capture;
  for (Light& light : points.lights) light.kind = PointLight{{1, 2, 3}, {4, 5, 6}};
  writeCapture(points, folder.path());
  expectError(disc, {"lights.radius_deg", "point lights"});
  writeCapture(capture, folder.path());
  expectError(with(kTurntable, from + "test = 2\n", with(camera, "")), {"views.test", "from"});
  EXPECT_NE(
      errorOf([&] { parse(with(kTurntable, "from = \"nowhere\"\n", with(camera, ""))); }).find("nowhere"),
      std::string::npos);
  for (Frame& frame : capture.frames) frame.split = Split::test;
  writeCapture(capture, folder.path());
  expectError(text, {"views.from", "training frames"});
}

// [Weyrich 2005, §3] and larger.
TEST(StageFile, RigsOfThePapersScaleAreRead) {
  const auto scale = [](const std::string& size, const std::string& views, const std::string& lights) {
    return parse(with("size = [40, 30]", size, with(kTurntable, views, with(kCount, lights))));
  };
  const std::string paper = "size = [1360, 1032]";
  const Stage doll =
      scale(paper, "turntable = 72\nelevations_deg = [-20, -5, 10, 25, 40, 55]\n", "count = 60\n");
  EXPECT_EQ(doll.rig.views.size(), 432u);
  EXPECT_EQ(doll.rig.lights.size(), 60u);
  const Stage mug =
      scale(paper, "turntable = 36\nelevations_deg = [-20, -5, 10, 25, 40, 55]\n", "count = 44\n");
  EXPECT_EQ(mug.rig.views.size(), 216u);
  EXPECT_EQ(mug.rig.lights.size(), 44u);
  size_t below = 0; // lights stand all around
  for (const Light& light : mug.rig.lights) below += std::get<DirectionalLight>(light.kind).towards.z() < 0;
  EXPECT_EQ(below, 22u);
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
