#include "render/scene/script.h"

#include "render/scene/scene.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/text.h"
#include "tests/warp/point_caches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect::scene {
namespace {

const std::string example = R"toml(
model = "doll.srf"
[frames]
first = 1
last = 48
fps = 24
[output]
size = [1024, 768]
path = "frame.####.exr"
png = true
aov = ["depth", "normal", "camera_blend", "light_blend", "stretch"]
[camera]
position = [0, 1, [[1, 5], [48, 3.5]]]
look_at = [0, 1, 0]
up = [0, 1, 0]
fov_deg = 30
[[light]]
type = "point"
position = ["2*cos(t)", 1, "2*sin(t)"]
color = [1, 0.2, 0.1]
intensity = 40
[[light]]
type = "directional"
direction = [0, 3, 4]
[[warp]]
type = "twist"
axis = [0, 1, 0]
center = [0, 0, 0]
angle_deg = [[1, 0], [24, 90, "smooth"], [48, 0]]
[[warp]]
type = "expression"
x = "x + 0.1*sin(6*y + t)"
y = "y"
z = "z"
)toml";

Script parse(const std::string& text) { return parseScript(text, "shots/shot.toml"); }

template <class Function> std::string complaintOf(Function function) {
  try {
    function();
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}
std::string complaint(const std::string& text) {
  return complaintOf([&] { parse(text); });
}

TEST(Script, TheExampleHoldsWhatItSays) {
  const Script script = parse(example);
  EXPECT_EQ(script.model, "shots/doll.srf");
  EXPECT_EQ(script.frames->count(), 48);
  EXPECT_EQ(script.output->width, 1024);
  EXPECT_EQ(script.output->height, 768);
  EXPECT_TRUE(script.output->png);
  EXPECT_EQ(script.output->aov.size(), 5u);
  EXPECT_TRUE(std::holds_alternative<LookAtCamera>(*script.camera));
  EXPECT_EQ(script.lights.size(), 2u);
  EXPECT_EQ(script.warps.size(), 2u);
  EXPECT_NO_THROW(requireShot(script));
}

TEST(Script, EveryTruncationIsAScriptOrAnError) {
  int scripts = 0;
  for (size_t length = 0; length < example.size(); ++length) {
    try {
      parse(example.substr(0, length));
      ++scripts;
    } catch (const Error& error) {
      EXPECT_EQ(error.file(), "shots/shot.toml");
    }
  }
  EXPECT_GT(scripts, 20);
  EXPECT_LT(scripts, static_cast<int>(example.size()) / 2);
}

TEST(Script, EveryDamagedByteGivesAScriptOrAnErrorOfOneLine) {
  std::mt19937 random(1);
  for (int i = 0; i < 5000; ++i) {
    std::string text = example;
    for (int k = 0; k < 3; ++k) text[random() % example.size()] = static_cast<char>(random());
    EXPECT_EQ(complaint(text).find('\n'), std::string::npos);
  }
}

TEST(Script, AnyValueOfAnyTypeInAnyPlaceGivesAScriptOrAnError) {
  for (const std::string_view value :
       {"0",           "-1",       "1e308", "nan",       "inf",        "true",
        "\"\"",        "\"x\"",    "[]",    "[[]]",      "[1]",        "[1, 2]",
        "[1, 2, 3]",   "[[1, 2]]", "{}",    "{ a = 1 }", "1979-05-27", "9223372036854775807",
        "\"\\u0000\"", "\"#\""}) {
    for (size_t begin = example.find(" = "); begin != std::string::npos;
         begin = example.find(" = ", begin + 1)) {
      const std::string changed =
          example.substr(0, begin + 3) + std::string(value) + example.substr(example.find('\n', begin));
      EXPECT_EQ(complaint(changed).find('\n'), std::string::npos);
    }
  }
}

// Freed by recursion, tables so deep would end the process.
TEST(Script, TablesAreNotReadThatHoldOneAnotherTooDeep) {
  std::string path = "a";
  for (int i = 0; i < 50000; ++i) path += ".a";
  const std::string wanted = ": found more tables in one another, expected at most 64";
  EXPECT_EQ(complaint("\n" + path + " = 1"), "shots/shot.toml: line 2" + wanted);
  EXPECT_EQ(complaint("[" + path + "]"), "shots/shot.toml: line 1" + wanted);
  EXPECT_EQ(complaint("x = { " + path + " = 1 }"), "shots/shot.toml: line 1" + wanted);
}

TEST(Script, AMisspeltKeyIsToldWithItsLineAndTheNearestKnownOne) {
  EXPECT_EQ(complaint(replaced(example, "look_at", "lookat")),
            "shots/shot.toml: camera.lookat: unknown key on line 14; did you mean look_at?");
  EXPECT_EQ(complaint(replaced(example, "angle_deg", "angel_deg")),
            "shots/shot.toml: warp[0].angel_deg: unknown key on line 29; did you mean angle_deg?");
  EXPECT_EQ(complaint("modle = \"a\""), "shots/shot.toml: modle: unknown key on line 1; did you mean model?");
}

TEST(Script, WholeNumbersMayHaveAPointAsOtherProgramsWriteThem) {
  EXPECT_EQ(parse(replaced(example, "first = 1", "first = 1.0")).frames->first, parse(example).frames->first);
}

TEST(Script, AWrongValueIsToldWithWhatWasExpected) {
  EXPECT_EQ(complaint(replaced(example, "first = 1", "first = 1.5")),
            "shots/shot.toml: frames.first: found 1.5 on line 4, expected an integer in 0..1000000");
  EXPECT_EQ(
      complaint(replaced(example, "[0, 3, 4]", "[0, true, 4]")),
      "shots/shot.toml: light[1].direction[1]: found true on line 24, expected a number, a list of keyframes "
      "or an expression");
  EXPECT_EQ(complaint(replaced(example, "\"smooth\"", "\"smoth\"")),
            "shots/shot.toml: warp[0].angle_deg[1][2]: found \"smoth\" on line 29, expected \"smooth\"");
  EXPECT_EQ(
      complaint(replaced(example, "\"twist\"", "\"melt\"")),
      "shots/shot.toml: warp[0].type: found \"melt\" on line 26, expected one of rigid, scale, twist, bend, "
      "taper, sine, expression, lattice, handles, mesh, skeleton");
  EXPECT_EQ(complaint(replaced(example, "\"point\"", "\"ambient\"")),
            "shots/shot.toml: light[0].type: found \"ambient\" on line 18, expected one of directional, "
            "point, environment");
  EXPECT_EQ(complaint(replaced(example, "\"stretch\"", "\"strech\"")),
            "shots/shot.toml: output.aov[4]: found \"strech\" on line 11, expected one of depth, normal, "
            "position, rest, camera_blend, light_blend, stretch, predicted_error; did you mean stretch?");
  EXPECT_EQ(complaint(replaced(example, "fov_deg = 30", "")),
            "shots/shot.toml: camera.fov_deg: missing from the table on line 12");
}

TEST(Script, FramesStayInsideTheOutputFolder) {
  for (const std::string path : {"../frame.##.exr", "a/../../frame.##.exr", "/tmp/frame.##.exr"})
    EXPECT_EQ(complaint(replaced(example, "frame.####.exr", path)),
              "shots/shot.toml: output.path: found \"" + path +
                  "\" on line 9, expected a name inside the folder of --output");
  EXPECT_EQ(parse(replaced(example, "frame.####.exr", "a/frame.##.exr")).output->path, "a/frame.##.exr");
}

TEST(Script, AFinishIsReadFromItsKeys) {
  const auto outputOf = [](const std::string& lines) {
    return *parse("[output]\nsize = [4, 3]\npath = \"#.exr\"\n" + lines).output;
  };
  EXPECT_EQ(outputOf("").finish, Finish());
  EXPECT_EQ(outputOf("background = \"transparent\"\ntone = \"none\"").finish, Finish());
  EXPECT_EQ(std::get<Rgb>(outputOf("background = [0, 0.5, 1]").finish.background), (Rgb{0, 0.5f, 1}));
  EXPECT_EQ(std::get<std::filesystem::path>(outputOf("background = \"sky.JPG\"").finish.background),
            "shots/sky.JPG");
  EXPECT_EQ(outputOf("tone = \"filmic\"").finish.tone, Tone::filmic);
  const Finish ocio = outputOf("tone = \"ocio\"\nocio_display = \"sRGB\"\nocio_view = \"Film\"").finish;
  EXPECT_EQ(ocio.tone, Tone::ocio);
  EXPECT_EQ(ocio.ocioDisplay + ' ' + ocio.ocioView, "sRGB Film");
  EXPECT_EQ(outputOf("video = \"all/film.mov\"").video, "all/film.mov");
}

TEST(Script, WhatIsNoFinishIsToldWithWhatWasExpected) {
  const auto told = [](const std::string& line) {
    return complaint("[output]\nsize = [4, 3]\npath = \"#.exr\"\n" + line);
  };
  for (const char* const color : {"[0, 1]", "[0, 0, 2]", "[0, 0, \"a\"]", "1", "\"sky.txt\"", "\"\""})
    EXPECT_NE(told(std::string("background = ") + color), "no complaint") << color;
  EXPECT_EQ(told("background = 1"), "shots/shot.toml: output.background: found 1 on line 4, expected "
                                    "\"transparent\", a colour [red, green, "
                                    "blue] of numbers in 0..1, or a picture's file");
  EXPECT_EQ(told("tone = \"filmc\""),
            "shots/shot.toml: output.tone: found \"filmc\" on line 4, expected one of none, "
            "filmic, ocio; did you mean filmic?");
  EXPECT_EQ(told("ocio_view = \"Film\""), "shots/shot.toml: output.ocio_view: found \"Film\" on line 4, "
                                          "expected no such key without tone = \"ocio\"");
  for (const char* const name : {"film.avi", "film", ".mp4", "../film.mp4", "/film.mov", "a/../../film.mov"})
    EXPECT_NE(told("video = \"" + std::string(name) + '"').find("output.video: found"), std::string::npos)
        << name;
}

TEST(Script, AnExposureMayStandBesideACapturedCamera) {
  const Script script = parse("[camera]\nfrom = \"C01\"\nexposure = [[1, 0], [3, 2]]");
  EXPECT_EQ(exposureAt(script, {.t = 0, .frame = 2, .s = 0}), 1);
  EXPECT_EQ(exposureAt(parse("[camera]\nfrom = \"C01\""), {}), std::nullopt);
}

TEST(Script, SizesAndFramesAreBounded) {
  EXPECT_NE(complaint(replaced(example, "1024", "0")), "no complaint");
  EXPECT_NE(complaint(replaced(example, "1024", "16385")), "no complaint");
  EXPECT_EQ(complaint(replaced(example, "1024", "16384")), "no complaint");
  EXPECT_NE(complaint(replaced(example, "last = 48", "last = 1000001")), "no complaint");
  EXPECT_NE(complaint(replaced(example, "last = 48", "last = 0")), "no complaint"); // before the first
  EXPECT_NE(complaint(replaced(example, "fps = 24", "fps = 0")), "no complaint");
}

TEST(Script, AKeyThatContradictsAnotherIsAnError) {
  EXPECT_EQ(complaint("[camera]\nfrom = \"C017\""), "no complaint");
  EXPECT_NE(complaint("[camera]\nfrom = \"C017\"\nfov_deg = 30"), "no complaint");
  EXPECT_NE(complaint("[camera]\nfov_deg = 30\nposition = [0,0,1]\norbit = {radius = 1, azimuth_deg = 0}"),
            "no complaint");
}

TEST(Script, AnyCameraMayBlur) {
  const std::string blur = "shutter_deg = 180\naperture = \"0.01*frame\"\n";
  const auto blurOf = [&](const std::string& camera) {
    const Script script =
        parse("[output]\nsize = [8, 8]\npath = \"#.exr\"\nsamples = 5\n[camera]\n" + camera + blur);
    EXPECT_EQ(script.output->samples, 5);
    return blurAt(script, shotTime(script, 4));
  };
  for (const auto& [camera, focus] : std::vector<std::pair<std::string, std::optional<double>>>{
           {"from = \"C1\"\n", {}},
           {"from = \"C1\"\nfocus_distance = [[2, 2], [6, 4]]\n", 3.0},
           {"position = [0, 3, 4]\nlook_at = [0, 0, 0]\nfov_deg = 30\n", 5.0},
           {"position = [0, 3, 4]\nlook_at = [0, 0, 0]\nfov_deg = 30\nfocus_distance = 2\n", 2.0},
           {"orbit = {radius = 7, azimuth_deg = 0}\nfov_deg = 30\n", 7.0}}) {
    const ShotBlur blurred = blurOf(camera);
    EXPECT_EQ(blurred.shutter, 0.5);
    EXPECT_DOUBLE_EQ(blurred.aperture, 0.04);
    EXPECT_EQ(blurred.focusDistance, focus) << camera;
  }
  EXPECT_TRUE(blurAt(parse(example), {}).isSharp());
  EXPECT_EQ(parse(example).output->samples, 16);
}

TEST(Script, ABlurThatCannotBeIsToldAtItsKey) {
  const auto complaintOfBlur = [&](const std::string& keys) {
    const Script script = parse(replaced(example, "fov_deg = 30", "fov_deg = 30\n" + keys));
    return complaintOf([&] { blurAt(script, shotTime(script, 4)); });
  };
  EXPECT_EQ(complaintOfBlur("shutter_deg = \"200*t + 400\""),
            "shots/shot.toml: camera.shutter_deg: found 425, expected 0 to 360");
  EXPECT_EQ(complaintOfBlur("aperture = -1"),
            "shots/shot.toml: camera.aperture: found -1, expected 0 or more");
  EXPECT_EQ(complaintOfBlur("aperture = 1\nfocus_distance = 0"),
            "shots/shot.toml: camera.focus_distance: found 0, expected more than 0");
  EXPECT_EQ(complaint("[camera]\nfrom = \"C1\"\naperure = 1"),
            "shots/shot.toml: camera.aperure: unknown key on line 3; did you mean aperture?");
  EXPECT_EQ(complaint("[output]\nsize = [8, 8]\npath = \"#.exr\"\nsamples = 1025"),
            "shots/shot.toml: output.samples: found 1025 on line 4, expected an integer in 1..1024");
}

TEST(Script, AGroundFacesTheCamerasUpUnlessItHasANormal) {
  const auto groundOf = [&](const std::string& camera, const std::string& ground) {
    const Script script = parse("[camera]\n" + camera + "\n[ground]\n" + ground);
    return *groundAt(script, {});
  };
  const std::string posed = "position = [4, 0, 0]\nlook_at = [0, 0, 0]\nfov_deg = 30\nup = [0, 0, 3]";
  const ShotGround upright = groundOf(posed, "point = [1, 2, -3]");
  EXPECT_EQ(upright.point.raw(), Vec3<double>(1, 2, -3));
  EXPECT_EQ(upright.normal.raw(), Vec3<double>(0, 0, 1));
  EXPECT_EQ(upright.shadow, 1);
  const ShotGround tilted = groundOf(posed, "point = [0, 0, 0]\nnormal = [0, 3, 4]\nshadow = 0.5");
  EXPECT_TRUE(tilted.normal.raw().isApprox(Vec3<double>(0, 0.6, 0.8)));
  EXPECT_EQ(tilted.shadow, 0.5);
  EXPECT_EQ(groundOf("from = \"C1\"", "point = [0, 0, 0]").normal.raw(), Vec3<double>(0, 1, 0));
  EXPECT_FALSE(groundAt(parse(example), {}));
  EXPECT_EQ(complaintOf([&] { groundOf(posed, "point = [0, 0, 0]\nshadow = 2"); }),
            "shots/shot.toml: ground.shadow: found 2, expected 0 to 1");
  EXPECT_EQ(complaint("[ground]\nnormal = [0, 1, 0]"),
            "shots/shot.toml: ground.point: missing from the table on line 1");
}

TEST(Script, WarpsMayStandAlone) {
  const Script script = parse("[[warp]]\ntype = \"rigid\"\ntranslate = [1, 2, 3]\n");
  EXPECT_EQ(warpAt(script, shotTime(script, 5))->position({0, 0, 0}), Vec3<double>(1, 2, 3));
  EXPECT_EQ(complaintOf([&] { requireShot(script); }),
            "shots/shot.toml: model: missing; a shot needs model, frames, output and camera");
}

TEST(Script, EachWarpTypeIsReadFromItsKeys) {
  const Script script = parse(R"toml(
warp = [
  {type = "rigid", axis = [0,1,0], center = [1,0,0], angle_deg = 90, translate = [0,0,1]},
  {type = "scale", factor = [2, 3, 4], center = [0,1,0]},
  {type = "twist", axis = [0,1,0], center = [0,0,1], angle_deg = 30, length = 2},
  {type = "bend", axis = [0,1,0], direction = [1,0,0], center = [0,0,1], angle_deg = 30, length = 2},
  {type = "sine", axis = [0,1,0], direction = [1,0,0], amplitude = 2, wavelength = 3, phase_deg = 20},
  {type = "expression", x = "x + y", y = "2*y", z = "frame"},
  {type = "taper", axis = [0,1,0], center = [0,0,1], factor = 0.25, length = 2},
  {type = "lattice", min = [-1,-1,-1], max = [1,1,"frame"], divisions = [1,2,1], point = [
    {at = [1,2,0], move = ["frame", 0, 0]}, {at = [0,0,1], move = [0, 2, 0]}]},
  {type = "handles", radius = 0.5, handle = [{rest = [0,0,0], to = [1,"frame",0]}, {rest = [1,0,0], to = [1,0,0]}]},
])toml");
  const Vec3<double> axis(0, 1, 0), direction(1, 0, 0), center(0, 0, 1);
  std::vector<warp::WarpPointer> expected;
  expected.push_back(warp::rigidWarp(axis, Angle::fromDegrees(90), {1, 0, 0}, {0, 0, 1}));
  expected.push_back(warp::scaleWarp({2, 3, 4}, {0, 1, 0}));
  expected.push_back(warp::twistWarp(axis, Angle::fromDegrees(15), center));
  expected.push_back(warp::bendWarp(axis, direction, Angle::fromDegrees(15), center));
  expected.push_back(warp::sineWarp({axis, direction, {0, 0, 0}, 2, 3, Angle::fromDegrees(20)}));
  const Vec3<double> x(0.3, 0.4, 0.5);
  ASSERT_EQ(script.warps.size(), 9u);
  for (size_t i = 0; i < expected.size(); ++i)
    EXPECT_LT((warp::evaluateAt(script.warps[i], {})->position(x) - expected[i]->position(x)).norm(), 1e-15)
        << i;
  const auto at7 = [&](size_t warp) { return warp::evaluateAt(script.warps[warp], {0, 7, 0})->position(x); };
  EXPECT_LT((at7(5) - Vec3<double>(0.7, 0.8, 7)).norm(), 1e-15);
  EXPECT_LT((at7(6) - warp::taperWarp(axis, std::log(0.25) / 2, center)->position(x)).norm(), 1e-15);
  warp::Lattice lattice{
      {-1, -1, -1}, {1, 1, 7}, {1, 2, 1}, std::vector<Vec3<double>>(12, Vec3<double>(0, 0, 0))};
  lattice.moves[lattice.pointIndex({1, 2, 0})] = {7, 0, 0};
  lattice.moves[lattice.pointIndex({0, 0, 1})] = {0, 2, 0};
  EXPECT_EQ(at7(7), warp::latticeWarp(lattice)->position(x));
  const std::vector<Vec3<double>> rest = {{0, 0, 0}, {1, 0, 0}}, targets = {{1, 7, 0}, {1, 0, 0}};
  EXPECT_EQ(at7(8), warp::Handles(rest, 0.5).pullTo(targets)->position(x));
}

TEST(Script, WhatMakesNoLatticeOrHandlesIsAnErrorAtItsKey) {
  const std::string lattice =
      "[[warp]]\ntype = \"lattice\"\nmin = [0,0,0]\nmax = [1,1,1]\ndivisions = [1,1,2]\n"
      "point = [{at = [0,1,2], move = [0,0,0]}, {at = [1,1,2], move = [0,0,0]}]\n";
  EXPECT_EQ(complaint(lattice), "no complaint");
  EXPECT_EQ(complaint(replaced(lattice, "[1,1,2]", "[1,17,2]")),
            "shots/shot.toml: warp[0].divisions[1]: found 17 on line 5, expected an integer in 1..16");
  EXPECT_EQ(complaint(replaced(lattice, "[0,1,2]", "[0,1,3]")),
            "shots/shot.toml: warp[0].point[0].at[2]: found 3 on line 6, expected an integer in 0..2");
  EXPECT_EQ(complaint(replaced(lattice, "[0,1,2]", "[1,1,2]")),
            "shots/shot.toml: warp[0].point[1].at: found an array of 3 on line 6, expected each control "
            "point once");
  const Script flat = parse(replaced(lattice, "[1,1,1]", "[1,1,\"frame\"]"));
  EXPECT_EQ(complaintOf([&] {
              warpAt(flat, {0, 0, 0});
            }),
            "shots/shot.toml: warp[0].max: found no more along one, expected more than min along every axis");

  const std::string handles = "[[warp]]\ntype = \"handles\"\nhandle = [{rest = [0,0,0], to = [1,0,0]}, "
                              "{rest = [0,1,0], to = [0,0,\"1/frame\"]}]\n";
  EXPECT_EQ(complaint(handles), "no complaint");
  EXPECT_EQ(complaint(handles + "radius = 0\n"),
            "shots/shot.toml: warp[0].radius: found 0 on line 4, expected more than 0");
  EXPECT_EQ(complaint(replaced(handles, "[0,1,0]", "[0,\"1\",0]")),
            "shots/shot.toml: warp[0].handle[1].rest[1]: found \"1\" on line 3, expected a finite number");
  EXPECT_NE(
      complaint(replaced(handles, "[0,1,0]", "[0,0,0]")).find("warp[0].handle: found handles 0 and 1 nearer"),
      std::string::npos);
  EXPECT_EQ(complaintOf([&] {
              warpAt(parse(handles), {0, 0, 0});
            }),
            "shots/shot.toml: warp[0].handle[1].to[2]: found inf at frame 0, expected a finite number");
}

TEST(Script, MeshesAndSkeletonsAreReadFromBesideTheScriptAndAreInItsHash) {
  const image::TemporaryFolder folder;
  const auto write = [&](const char* name, const std::string& text) {
    writeFileAtomically(folder / name, std::string_view(text));
  };
  const std::string faces = "f 1 2 3\nf 1 2 4\n";
  write("rest.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + faces);
  write("cage.2.obj", "v 4 0 0\nv 5 0 0\nv 4 1 0\nv 4 0 1\n" + faces);
  write("shot.toml",
        "[[warp]]\ntype = \"mesh\"\nrest = \"rest.obj\"\nframes = \"cage.#.obj\"\nframe = \"frame - 5\"\n");
  const Script script = readScript(folder / "shot.toml");
  EXPECT_LT((warpAt(script, {0, 7, 0})->position({0, 0, 0}) - Vec3<double>(4, 0, 0)).norm(), 1e-14);
  write("cage.2.obj", "v 4 0 0\nv 5 0 0\nv 4 1 0\nv 4 0 1.5\n" + faces);
  EXPECT_NE(readScript(folder / "shot.toml").hash, script.hash);

  write("rig.toml", "[[warp]]\ntype = \"skeleton\"\nfile = \"rig.glb\"\n");
  EXPECT_EQ(complaintOf([&] { readScript(folder / "rig.toml"); }).find((folder / "rig.glb").string()), 0u);
}

// Keys at frames 0 and 24 in both formats; an MDD counts the film's seconds, a PC2 its frames.
TEST(Script, AMeshFromACacheMovesAsItsFilesDo) {
  const image::TemporaryFolder folder;
  const std::string faces = "f 1 2 3\nf 1 2 4\n";
  const std::vector<Vec3<double>> rest{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      bent{{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5}, {0, 1, 1}};
  const auto obj = [&](const std::vector<Vec3<double>>& points) {
    std::string text;
    for (const auto& p : points)
      text += "v " + numberText(p[0]) + " " + numberText(p[1]) + " " + numberText(p[2]) + "\n";
    return text + faces;
  };
  image::writeBytes(folder / "rest.obj", obj(rest));
  image::writeBytes(folder / "cage.0.obj", obj(rest));
  image::writeBytes(folder / "cage.24.obj", obj(bent));
  image::writeBytes(folder / "a.mdd", warp::mddBytes({0, 1}, {rest, bent}));
  image::writeBytes(folder / "a.pc2", warp::pc2Bytes(0, 24, {rest, bent}));
  const std::string head = "frames = { first = 1, last = 48, fps = 24 }\n[[warp]]\ntype = \"mesh\"\nrest = "
                           "\"rest.obj\"\n";
  const auto placed = [&](const std::string& keys, double frame) -> Vec3<double> {
    const Script script = parseScript(head + keys, folder / "shot.toml");
    return warpAt(script, shotTime(script, frame))->position({0.1, 0.2, 0.6});
  };
  const std::string files = "frames = \"cage.#.obj\"\n", mdd = "cache = \"a.mdd\"\n",
                    pc2 = "cache = \"a.pc2\"\n";
  ASSERT_GT((placed(files, 24) - placed(files, 1)).norm(), 0.1);
  for (const double frame : {1.0, 7.0, 20.5, 30.0}) {
    EXPECT_LT((placed(pc2, frame) - placed(files, frame)).norm(), 1e-6);
    // The film's first frame is second 0.
    EXPECT_LT((placed(mdd, frame) - placed(files + "frame = \"frame - 1\"\n", frame)).norm(), 1e-6);
    EXPECT_LT((placed(mdd + "time = \"t/2\"\n", frame) - placed(files + "frame = \"(frame - 1)/2\"\n", frame))
                  .norm(),
              1e-6);
    EXPECT_LT((placed(pc2 + "frame = \"frame/2\"\n", frame) - placed(files + "frame = \"frame/2\"\n", frame))
                  .norm(),
              1e-6);
  }
  const auto refusal = [&](const std::string& keys) {
    const std::string line = complaintOf([&] { parseScript(head + keys, folder / "shot.toml"); });
    return line.substr(std::min(line.size(), line.find("warp[0]")));
  };
  EXPECT_EQ(refusal(files + "time = \"t\"\n"),
            "warp[0].time: found \"t\" on line 6, expected no such key without a cache in MDD");
  EXPECT_EQ(refusal(pc2 + "time = \"t\"\n"),
            "warp[0].time: found \"t\" on line 6, expected frame instead: a PC2 counts frames");
  EXPECT_EQ(refusal(mdd + "frame = \"frame\"\n"),
            "warp[0].frame: found \"frame\" on line 6, expected time instead: an MDD counts seconds");
  EXPECT_NE(refusal(mdd + files).find("expected either frames or cache"), std::string::npos);
  EXPECT_EQ(complaintOf([&] {
              parseScript("coordinates = \"original\"\n" + head + mdd, folder / "shot.toml", {1, 2, 3});
            }).substr((folder / "shot.toml").string().size()),
            ": warp[0].cache: point caches are single precision, too coarse for original coordinates: use "
            "frames");
}

// Moving all places of a script and its model's origin together changes nothing.
TEST(Script, PlacesInOriginalCoordinatesCountFromTheModelsOrigin) {
  const Vec3<double> origin(500000, 4600000, 30);
  const auto place = [](const Vec3<double>& p) {
    return numberText(p[0]) + "," + numberText(p[1]) + "," + numberText(p[2]);
  };
  const auto scriptAt = [&](const char* coordinates, const Vec3<double>& moved) {
    const auto at = [&](double x, double y, double z) {
      return "[" + place(Vec3<double>(x, y, z) + moved) + "]";
    };
    const std::string n = numberText(moved[0]);
    return std::string("coordinates = \"") + coordinates + "\"\n[camera]\nposition = [\"4 + " + n + "\", " +
           numberText(moved[1]) + ", [[1, " + numberText(moved[2]) + "]]]\nlook_at = " + at(0, 0, 1) +
           "\nfov_deg = 30\n[output]\nsize = [8, 8]\npath = \"#.exr\"\n[[light]]\ntype = \"point\"\nposition "
           "= " +
           at(1, 2, 3) + "\n[[warp]]\ntype = \"scale\"\nfactor = [2, 3, 4]\ncenter = " + at(0, 1, 0) +
           "\n[[warp]]\ntype = \"scale\"\nfactor = [2, 2, 2]\ncenter = " + at(0, 0, 0) +
           "\n[[warp]]\ntype = \"expression\"\nx = \"x\"\ny "
           "= \"y + 0.5*(x - " +
           n + ")\"\nz = \"z\"\n[[warp]]\ntype = \"lattice\"\nmin = " + at(-1, -1, -1) +
           "\nmax = " + at(1, 1, 1) +
           "\ndivisions = [1, 1, 1]\npoint = [{at = [0, 0, 0], move = [0, 0, 0.5]}]\n[[warp]]\ntype = "
           "\"handles\"\nhandle = [{rest = " +
           at(0, 0, 0) + ", to = " + at(0, 1, 0) + "}, {rest = " + at(0, 0, 2) + ", to = " + at(0, 0, 2) +
           "}]\n";
  };
  const Script near = parse(scriptAt("model", {0, 0, 0})),
               far = parseScript(scriptAt("original", origin), "shots/shot.toml", origin);
  EXPECT_LT((cameraAt(far, {}).center().raw() - cameraAt(near, {}).center().raw()).norm(), 1e-8);
  EXPECT_EQ(std::get<ShotPointLight>(lightsAt(far, {})[0]).position,
            std::get<ShotPointLight>(lightsAt(near, {})[0]).position);
  const Vec3<double> x(0.3, 0.4, 0.5);
  EXPECT_LT((warpAt(far, {})->position(x) - warpAt(near, {})->position(x)).norm(), 1e-7);
  EXPECT_EQ(complaint("coordinates = \"utm\""),
            "shots/shot.toml: coordinates: found \"utm\" on line 1, expected one of model, original");
}

TEST(Script, ACenterMayBeLeftOutOnlyWhereTheModelsOriginIsThatOfItsSource) {
  const std::string orbit = "[camera]\nfov_deg = 30\norbit = { radius = 4, azimuth_deg = 0 }\n",
                    turn = "[[warp]]\ntype = \"rigid\"\nangle_deg = 20\n",
                    centered = turn + "center = [0, 0, 0]\n";
  const auto complaintWith = [](const std::string& coordinates, const std::string& text,
                                const Vec3<double>& origin) {
    return complaintOf(
        [&] { parseScript("coordinates = \"" + coordinates + "\"\n" + text, "shot.toml", origin); });
  };
  const std::string end = ".center: found nothing, expected three numbers, as coordinates are original";
  EXPECT_EQ(complaintWith("original", orbit, {0, 0, 30}), "shot.toml: camera.orbit" + end);
  EXPECT_EQ(complaintWith("original", centered + turn, {0, 0, 30}), "shot.toml: warp[1]" + end);
  EXPECT_EQ(complaintWith("original", centered, {0, 0, 30}), "no complaint");
  EXPECT_EQ(complaintWith("original", orbit + turn, {0, 0, 0}), "no complaint");
  EXPECT_EQ(complaintWith("model", orbit + turn, {0, 0, 30}), "no complaint");
}

TEST(Script, ItsHeadIsReadWithoutTheFilesOfWarps) {
  const image::TemporaryFolder folder;
  const auto path = folder / "shot.toml";
  const std::string frames = "model = \"doll.srf\"\ncoordinates = \"original\"\n"
                             "frames = { first = 2, last = 5 }\n"
                             "output = { size = [8, 6], path = \"#.exr\" }\n",
                    camera = "camera = { from = \"C1\" }\n",
                    warp = "[[warp]]\ntype = \"mesh\"\nrest = \"none.obj\"\nframes = \"none.#.obj\"\n";
  writeFileAtomically(path, std::string_view(frames + camera + warp));
  const ScriptHead head = readScriptHead(path);
  EXPECT_EQ(head.model, folder / "doll.srf");
  EXPECT_EQ(head.coordinates, Coordinates::original);
  EXPECT_EQ(head.frames.last, 5);
  EXPECT_EQ(head.output.height, 6);
  EXPECT_THROW(readScript(path), Error);
  writeFileAtomically(path, std::string_view(frames + warp));
  EXPECT_EQ(complaintOf([&] { readScriptHead(path); }),
            path.string() + ": camera: missing; a shot needs model, frames, output and camera");
}

TEST(Script, AMeshInOriginalCoordinatesIsReadToDoublePrecision) {
  const image::TemporaryFolder folder;
  const auto write = [&](const char* name, const std::string& corners) {
    writeFileAtomically(folder / name, std::string_view(corners + "f 1 2 3\nf 1 2 4\n"));
  };
  write("rest.obj", "v 500000 4600000 0\nv 500001 4600000 0\nv 500000 4600001 0\nv 500000 4600000 1\n");
  write("cage.1.obj",
        "v 500000 4600000.125 0\nv 500001 4600000.125 0\nv 500000 4600001.125 0\nv 500000 4600000.125 1\n");
  const std::string text =
      "coordinates = \"original\"\n[[warp]]\ntype = \"mesh\"\nrest = \"rest.obj\"\nframes = \"cage.#.obj\"\n";
  const Script script = parseScript(text, folder / "shot.toml", {500000, 4600000, 0});
  EXPECT_LT((warpAt(script, {})->position({0, 0, 0}) - Vec3<double>(0, 0.125, 0)).norm(), 1e-12);
  EXPECT_EQ(complaintOf([&] {
              parseScript("coordinates = \"original\"\n[[warp]]\ntype = \"skeleton\"\nfile = \"a.glb\"\n",
                          "shot.toml", {1, 2, 3});
            }),
            "shot.toml: warp[0].file: glTF is single precision, too coarse for original coordinates: use a "
            "mesh or handles");
}

TEST(Script, ReadingKeepsThePathAndTheHashOfTheText) {
  const image::TemporaryFolder folder;
  const auto path = folder / "shot.toml";
  writeFileAtomically(path, std::string_view(example));
  const Script script = readScript(path);
  std::filesystem::remove(path);
  EXPECT_EQ(script.path, path);
  EXPECT_EQ(script.model, path.parent_path() / "doll.srf");
  EXPECT_EQ(script.hash, contentHash(std::as_bytes(std::span(example))));
  EXPECT_THROW(readScript(path), Error);
}

TEST(Shot, TimeRunsFromZeroToOneOverTheFrames) {
  const Script script = parse(example);
  const warp::ShotTime first = shotTime(script, 1), last = shotTime(script, 48);
  EXPECT_EQ(first.t, 0);
  EXPECT_EQ(first.s, 0);
  EXPECT_EQ(last.t, 47. / 24);
  EXPECT_EQ(last.s, 1);
  EXPECT_EQ(last.frame, 48);
}

TEST(Shot, FramePathsArePadded) {
  Output output;
  output.path = "a/frame.####.exr";
  EXPECT_EQ(framePath(output, "out", 7), "out/a/frame.0007.exr");
  EXPECT_EQ(framePath(output, "out", 123456), "out/a/frame.123456.exr");
}

TEST(Shot, WarpsActInTheOrderWritten) {
  const Script script = parse(example);
  const warp::ShotTime time = shotTime(script, 24);
  const Vec3<double> x(0.5, 0.25, -0.5);
  const double turn = std::numbers::pi / 2 * x.y(); // 90 degrees a unit at frame 24
  const Vec3<double> twisted(x.x() * std::cos(turn) + x.z() * std::sin(turn), x.y(),
                             x.z() * std::cos(turn) - x.x() * std::sin(turn));
  const Vec3<double> moved = twisted + 0.1 * std::sin(6 * twisted.y() + time.t) * Vec3<double>::UnitX();
  EXPECT_LT((warpAt(script, time)->position(x) - moved).norm(), 1e-15);
}

TEST(Shot, LightsAreColorTimesIntensityAtTheirPlaces) {
  const Script script = parse(example);
  const warp::ShotTime time = shotTime(script, 13);
  const auto lights = lightsAt(script, time);
  const auto& point = std::get<ShotPointLight>(lights.at(0));
  EXPECT_LT((point.position.raw() - Vec3<double>(2 * std::cos(0.5), 1, 2 * std::sin(0.5))).norm(), 1e-15);
  EXPECT_EQ(point.intensity, (Rgb{40, 8, 4}));
  const auto& sun = std::get<ShotDirectionalLight>(lights.at(1));
  EXPECT_LT((sun.towards.raw() - Vec3<double>(0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_EQ(sun.irradiance, (Rgb{1, 1, 1}));
}

const std::string studioLight = R"toml(
[[light]]
type = "environment"
image = "maps/studio.exr"
mapping = "angular"
up = [0, 0, 1]
rotate_deg = "30*t"
color = [1, 0.5, 0]
intensity = 2
error = 0.05
uncovered = "extrapolate"
)toml";

TEST(Script, AnEnvironmentHoldsWhatItSays) {
  const auto full = std::get<EnvironmentLightMotion>(parse(studioLight).lights[0]);
  EXPECT_EQ(full.image, "shots/maps/studio.exr");
  EXPECT_EQ(full.mapping, weights::EnvironmentMapping::angular);
  EXPECT_EQ(full.up[2].at({}), 1);
  EXPECT_EQ(full.rotateDeg.at({2, 0, 0}), 60);
  EXPECT_EQ(full.color[1].at({}), 0.5);
  EXPECT_EQ(full.intensity.at({}), 2);
  EXPECT_EQ(full.error, 0.05);
  EXPECT_EQ(full.extrapolation, weights::LightExtrapolation::clamp);
  const auto bare = std::get<EnvironmentLightMotion>(
      parse("[[light]]\ntype = \"environment\"\nimage = \"/a.hdr\"").lights[0]);
  EXPECT_EQ(bare.image, "/a.hdr");
  EXPECT_FALSE(bare.mapping);
  EXPECT_EQ(bare.up[1].at({}), 1);
  EXPECT_EQ(bare.extrapolation, weights::LightExtrapolation::fade);
}

TEST(Script, WhatIsNoEnvironmentIsToldWithWhatWasExpected) {
  const auto told = [](std::string_view old, std::string_view by) {
    return complaint(replaced(studioLight, old, by));
  };
  EXPECT_NE(told("image = \"maps/studio.exr\"", "").find("light[0].image: missing"), std::string::npos);
  EXPECT_NE(told("\"angular\"", "\"cube\"").find("light[0].mapping: found \"cube\""), std::string::npos);
  EXPECT_NE(told("\"angular\"", "\"cube\"").find("one of latlong, angular, mirror_ball"), std::string::npos);
  EXPECT_NE(told("0.05", "0").find("light[0].error: found 0"), std::string::npos);
  EXPECT_NE(told("0.05", "2").find("0.0001..1"), std::string::npos);
  EXPECT_NE(told("extrapolate", "drop").find("one of extrapolate, fade"), std::string::npos);
  EXPECT_NE(told("rotate_deg", "rotate_dge").find("did you mean rotate_deg?"), std::string::npos);
}

TEST(Script, LampsFadeWhenAsked) {
  const Script script = parse("[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nuncovered = \"fade\"\n"
                              "[[light]]\ntype = \"directional\"\ndirection = [1, 2, 3]");
  const auto lights = lightsAt(script, {});
  EXPECT_EQ(std::get<ShotPointLight>(lights[0]).extrapolation, weights::LightExtrapolation::fade);
  EXPECT_EQ(std::get<ShotDirectionalLight>(lights[1]).extrapolation, weights::LightExtrapolation::clamp);
}

TEST(Shot, ALookAtCameraSeesItsTargetInTheMiddleAndItsUpUpwards) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 200; ++i) {
    Script script;
    script.output = Output{640, 480, "a.#.exr"};
    const Vec3<double> target(uniform(random), uniform(random), uniform(random));
    const Vec3<double> position =
        target + Vec3<double>(2 + uniform(random), uniform(random), 1 + uniform(random));
    const Vec3<double> up(uniform(random), 2, uniform(random));
    const double fov = 40 + 20 * uniform(random);
    script.camera = LookAtCamera{{position[0], position[1], position[2]},
                                 {target[0], target[1], target[2]},
                                 {up[0], up[1], up[2]},
                                 fov};
    const capture::Camera<ObjectSpace> camera = cameraAt(script, {});
    EXPECT_LT((camera.center().raw() - position).norm(), 3e-15);
    const Mat3<double> r = camera.cameraFromWorld.rotation();
    EXPECT_LT((r * r.transpose() - Mat3<double>::Identity()).norm(), 1.5e-15);
    EXPECT_NEAR(r.determinant(), 1, 1e-15);

    const auto pixelOf = [&](const Vec3<double>& x) {
      return *camera.project(assume<Point3<ObjectSpace, double>>(x));
    };
    EXPECT_NEAR(pixelOf(target).x, 320, 2.3e-13);
    EXPECT_NEAR(pixelOf(target).y, 240, 3.5e-13);
    EXPECT_NEAR(pixelOf(target + 0.01 * up).x, 320, 3.5e-13);
    EXPECT_LT(pixelOf(target + 0.01 * up).y, 240);
    // The upper edge of the picture is fov/2 away from the axis.
    const Vec3<double> edge =
        target + (position - target).norm() * std::tan(fov * std::numbers::pi / 360) * Vec3<double>(r.row(1));
    EXPECT_NEAR(pixelOf(edge).y, 0, 3.5e-13);
  }
}

Vec3<double> orbitPosition(const warp::Track3& up, double azimuth, double elevation) {
  Script script;
  script.output = Output{64, 64, "a.#.exr"};
  script.camera = OrbitCamera{{1, 2, 3}, up, 2, azimuth, elevation, 30};
  return cameraAt(script, {}).center().raw() - Vec3<double>(1, 2, 3);
}

TEST(Shot, AnOrbitStartsInFrontAndTurnsCounterclockwiseSeenFromAbove) {
  const warp::Track3 y{0, 1, 0}, z{0, 0, 3};
  EXPECT_LT((orbitPosition(y, 0, 0) - Vec3<double>(0, 0, 2)).norm(), 1e-15);
  EXPECT_LT((orbitPosition(y, 90, 0) - Vec3<double>(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((orbitPosition(y, 0, 30) - Vec3<double>(0, 1, std::sqrt(3))).norm(), 9e-16);
  EXPECT_LT((orbitPosition(z, 0, 0) - Vec3<double>(0, -2, 0)).norm(), 9e-16);
  EXPECT_LT((orbitPosition(z, 90, 0) - Vec3<double>(2, 0, 0)).norm(), 9e-16);
}

TEST(Shot, AnOrbitMayStandOnItsHead) {
  const warp::Track3 down{0, -1, 0};
  EXPECT_LT((orbitPosition(down, 0, 0) - Vec3<double>(0, 0, 2)).norm(), 9e-16);
  EXPECT_LT((orbitPosition(down, 90, 0) - Vec3<double>(-2, 0, 0)).norm(), 9e-16);
  EXPECT_LT((orbitPosition(down, 0, 30) - Vec3<double>(0, -1, std::sqrt(3))).norm(), 9e-16);
  for (const double aside : {1e-3, 1e-6, 1e-9, 1e-15, 1e-161}) {
    const warp::Track3 nearly{aside, -1, 0};
    const Vec3<double> place = orbitPosition(nearly, 20, 50);
    EXPECT_NEAR(place.norm(), 2, 2e-15) << aside;
    EXPECT_NEAR(place.dot(Vec3<double>(aside, -1, 0).normalized()), 2 * std::sin(50 * std::numbers::pi / 180),
                2e-15);
  }
}

TEST(Shot, WhatMakesNoCameraLightOrWarpAtSomeFrameIsAnErrorThatSaysWhere) {
  const auto at = [](const std::string& old, const std::string& by, double frame) {
    const Script script = parse(replaced(example, old, by));
    return complaintOf([&] {
      const warp::ShotTime time = shotTime(script, frame);
      cameraAt(script, time);
      lightsAt(script, time);
      warpAt(script, time);
    });
  };
  EXPECT_EQ(at("fov_deg = 30", "fov_deg = 30", 9), "no complaint");
  EXPECT_EQ(at("fov_deg = 30", "fov_deg = \"1/(frame-9)\"", 9),
            "shots/shot.toml: camera.fov_deg: found inf at frame 9, expected a finite number");
  EXPECT_EQ(at("fov_deg = 30", "fov_deg = 180", 9),
            "shots/shot.toml: camera.fov_deg: found 180, expected more than 0.001 and less than 179.999");
  EXPECT_EQ(at("up = [0, 1, 0]", "up = [0, 0, 1]", 1),
            "shots/shot.toml: camera.up: found the viewing direction, expected another direction");
  EXPECT_EQ(at("[0, 3, 4]", "[0, 0, 0]", 9),
            "shots/shot.toml: light[1].direction: found length 0 at frame 9, expected a direction");
  EXPECT_EQ(
      at("intensity = 40", "intensity = -1", 9),
      "shots/shot.toml: light[0].intensity: found color times intensity -1 at frame 9, expected 0 to 3.4e38");
  EXPECT_EQ(at("axis = [0, 1, 0]", "axis = [0, \"9 - frame\", 0]", 9),
            "shots/shot.toml: warp[0].axis: found length 0 at frame 9, expected a direction");
}

// A scene of several models, which a light field method joins.
TEST(ScriptObjects, ArePlacedByTheirTables) {
  const Script script = parseScript("[[object]]\nmodel = 'a.lfm'\n"
                                    "[[object]]\nmodel = '../b.lfm'\nposition = [1, 2, 3]\n"
                                    "[[object]]\nmodel = './a.lfm'\nrotate_deg = 90\nscale = 0.5\n",
                                    "/scenes/shelf.toml");
  ASSERT_EQ(script.objects.size(), 3u);
  EXPECT_TRUE(script.model.empty());
  EXPECT_EQ(script.objects[0].model, "/scenes/a.lfm");
  EXPECT_EQ(script.objects[1].model, "/b.lfm");
  EXPECT_EQ(script.objects[2].model, script.objects[0].model) << "one model by two names";
  EXPECT_EQ(script.objects[0].position, Vec3<double>(0, 0, 0));
  EXPECT_EQ(script.objects[1].position, Vec3<double>(1, 2, 3));
  EXPECT_EQ(script.objects[2].scale, 0.5);
  // A quarter turn about z.
  EXPECT_LT((script.objects[2].rotation * Vec3<double>(1, 0, 0) - Vec3<double>(0, 1, 0)).norm(), 1e-15);
}

TEST(ScriptObjects, FaultsAreNamed) {
  const std::string object = "[[object]]\nmodel = 'a.lfm'\n", place = "shots/shot.toml: object";
  EXPECT_EQ(complaint("object = []"), place + ": found an array of 0 on line 1, expected 1 to 10000 tables");
  EXPECT_EQ(complaint("model = 'a.lfm'\n" + object),
            "shots/shot.toml: model: found \"a.lfm\" on line 1, expected no model beside [[object]]");
  EXPECT_EQ(complaint("[[object]]\nscale = 1"), place + "[0].model: missing from the table on line 1");
  EXPECT_EQ(complaint(object + "scale = 0"),
            place + "[0].scale: found 0 on line 3, expected 1e-06 to 1000000");
  EXPECT_EQ(complaint(object + "position = [1, 2]"),
            place + "[0].position: found an array of 2 on line 3, expected an array of 3 numbers");
  EXPECT_EQ(complaint(object + "rotate_axis = [0, 0, 1]"),
            place + "[0].rotate_axis: found an array of 3 on line 3, expected rotate_deg beside it");
  EXPECT_EQ(complaint(object + "rotate_axis = [0, 0, 0]\nrotate_deg = 1"),
            place + "[0].rotate_axis: found an array of 3 on line 3, expected a direction other than 0");
  EXPECT_EQ(complaint(object + "turn = 3"),
            place +
                "[0].turn: unknown key on line 3; known are model, position, rotate_axis, rotate_deg, scale");
}

} // namespace
} // namespace surflect::scene
