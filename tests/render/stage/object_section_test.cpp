#include "render/stage/object_section.h"

#include "render/stage/shapes.h"
#include "surfel/base/error.h"
#include "tests/render/stage/stage_example.h"
#include "tests/render/stage/surfaces.h"
#include "tests/srf/image/files.h"
#include "tests/warp/gltf_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace surflect::stage {

namespace {

// A shape as OBJ, with its texture coordinates; vertices at the texture's seam are one.
std::string objOf(const Surface& shape) {
  std::string vertices, coordinates, faces;
  std::map<std::array<float, 3>, size_t> numbers;
  std::vector<size_t> numberOf;
  for (size_t i = 0; i < shape.mesh.positions.size(); ++i) {
    const auto& p = shape.mesh.positions[i];
    const auto [found, isNew] = numbers.try_emplace({p.x(), p.y(), p.z()}, numbers.size() + 1);
    char line[200];
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", p.x(), p.y(), p.z());
    if (isNew) vertices += line;
    numberOf.push_back(found->second);
    std::snprintf(line, sizeof line, "vt %.17g %.17g\n", shape.textureCoordinates[i].x(),
                  shape.textureCoordinates[i].y());
    coordinates += line;
  }
  for (const auto& triangle : shape.mesh.triangles) {
    faces += "f";
    for (const uint32_t i : triangle)
      faces += " " + std::to_string(numberOf[i]) + "/" + std::to_string(i + 1);
    faces += "\n";
  }
  return vertices + coordinates + faces;
}

TEST(SurfaceFile, MeshesComeFromFilesSmoothOrFaceted) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "tent.obj", "v 0 0 0\nv 1 0 1\nv 0 2 0\nv -1 0 1\nf 1 2 3\nf 1 3 4\n");
  const Surface smooth = readSurface(folder / "tent.obj", true).surface,
                faceted = readSurface(folder / "tent.obj", false).surface;
  EXPECT_EQ(smooth.mesh.positions.size(), 4u);
  EXPECT_LT((smooth.normals[0].raw() - Vec3<double>::UnitZ()).norm(), 1e-7); // both triangles alike
  EXPECT_EQ(faceted.mesh.positions.size(), 6u);
  EXPECT_LT(largestTilt(faceted), 1e-7);
  EXPECT_GT(largestTilt(smooth), 0.5);
}

TEST(SurfaceFile, ObjNormalsCountWhereItIsSmooth) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "flat.obj", "v 0 0 0\nv 2 0 0\nv 2 2 0\nvn 3 0 3\nvn 0 0 0\nf 1//1 2//1 3//2\n");
  const Surface smooth = readSurface(folder / "flat.obj", true).surface;
  EXPECT_LT((smooth.normals[1].raw() - Vec3<double>(1, 0, 1).normalized()).norm(), 1e-12);
  EXPECT_EQ(smooth.normals[2].raw(), Vec3<double>::UnitZ()); // none is none
  for (const auto& normal : readSurface(folder / "flat.obj", false).surface.normals)
    EXPECT_EQ(normal.raw(), Vec3<double>::UnitZ());
}

TEST(SurfaceFile, ASphereReadBackHasItsTextureItsTangentsAndNoSeam) {
  const image::TemporaryFolder folder;
  const Surface ball = sphere({0, 0, 0}, 1, 64);
  image::writeBytes(folder / "ball.obj", objOf(ball));
  const Surface read = readSurface(folder / "ball.obj", true).surface;
  EXPECT_EQ(read.mesh.triangles.size(), ball.mesh.triangles.size());
  EXPECT_NEAR(volumeOf(read.mesh), volumeOf(ball.mesh), 1e-6);
  EXPECT_LT(largestLift(read), 1e-9);
  for (size_t i = 0; i < read.mesh.positions.size(); ++i) {
    const Vec3<double> p = read.mesh.positions[i].cast<double>().raw();
    EXPECT_LT((read.normals[i].raw() - p).norm(), std::numbers::pi / 64); // also on the seam
    if (std::abs(p.z()) > 0.99) continue;
    const double longitude = std::atan2(p.y(), p.x()) / (2 * std::numbers::pi);
    const double s = read.textureCoordinates[i].x();
    EXPECT_NEAR(std::remainder(s - longitude, 1), 0, 1e-6);
    EXPECT_GT(read.tangents[i].raw().dot(Vec3<double>(-p.y(), p.x(), 0).normalized()),
              std::cos(std::numbers::pi / 64));
  }
}

TEST(SurfaceFile, AMirroredTextureHasTheTangentsOfItsFirstCoordinate) {
  const image::TemporaryFolder folder;
  for (const auto& [coordinates, along] : {std::pair{"vt 0 0\nvt 1 0\nvt 1 1\n", Vec3<double>(1, 0, 0)},
                                           std::pair{"vt 0 0\nvt -1 0\nvt -1 1\n", Vec3<double>(-1, 0, 0)},
                                           std::pair{"vt 0 0\nvt 0 1\nvt 1 1\n", Vec3<double>(0, 1, 0)}}) {
    image::writeBytes(folder / "flat.obj",
                      "v 0 0 0\nv 2 0 0\nv 2 2 0\nf 1/1 2/2 3/3\n" + std::string(coordinates));
    const Surface surface = readSurface(folder / "flat.obj", true).surface;
    for (const auto& tangent : surface.tangents) EXPECT_LT((tangent.raw() - along).norm(), 1e-12);
  }
}

TEST(SurfaceFile, GltfComesWithItsNormalsAndTexture) {
  const image::TemporaryFolder folder;
  warp::GltfMaker maker;
  nlohmann::json attributes;
  attributes["POSITION"] = maker.addFloats("VEC3", 3, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  attributes["NORMAL"] = maker.addFloats("VEC3", 3, {1, 0, 1, 1, 0, 1, 1, 0, 1, 1, 0, 1});
  attributes["TANGENT"] = maker.addFloats("VEC4", 4, {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1});
  attributes["TEXCOORD_0"] = maker.addFloats("VEC2", 2, {0, 1, 1, 1, 1, 0, 0, 0});
  const size_t corners =
      maker.add<uint8_t>("SCALAR", 5121, 1, {0, 1, 2, 0, 2, 3, 0, 0, 1}); // the last has no area
  maker.document["nodes"] = {{{"mesh", 0}}};
  maker.document["meshes"] = {{{"primitives", {{{"attributes", attributes}, {"indices", corners}}}}}};
  image::writeBytes(folder / "flat.GLB", maker.glb());
  const auto [smooth, hash] = readSurface(folder / "flat.GLB", true);
  EXPECT_EQ(smooth.mesh.triangles.size(), 2u);
  EXPECT_LT((smooth.normals[0].raw() - Vec3<double>(1, 0, 1).normalized()).norm(), 1e-6);
  EXPECT_EQ(smooth.textureCoordinates[2], Vec2<double>(1, 1));
  for (const auto& tangent : smooth.tangents) EXPECT_EQ(tangent.raw(), Vec3<double>::UnitY());
  const Surface faceted = readSurface(folder / "flat.GLB", false).surface;
  EXPECT_LT(largestTilt(faceted), 1e-6);
  for (const auto& tangent : faceted.tangents)
    EXPECT_EQ(tangent.raw(), Vec3<double>::UnitX()); // the texture's
  maker.binary[0] = 1;
  image::writeBytes(folder / "flat.GLB", maker.glb());
  EXPECT_NE(readSurface(folder / "flat.GLB", true).hash, hash);
}

TEST(SurfaceFile, PlyComesWithItsTexture) {
  const image::TemporaryFolder folder;
  const std::string ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nproperty float s\nproperty float t\nelement face 1\n"
                          "property list uchar int vertex_index\nend_header\n"
                          "0 0 0 0 0\n2 0 0 0 1\n2 2 0 1 1\n3 0 1 2\n";
  image::writeBytes(folder / "flat.ply", ply);
  const Surface surface = readSurface(folder / "flat.ply", true).surface;
  ASSERT_EQ(surface.textureCoordinates.size(), 3u);
  EXPECT_EQ(surface.textureCoordinates[1], Vec2<double>(0, 1)); // (0, 0) is the lower left, as in OBJ
  EXPECT_LT((surface.tangents[0].raw() - Vec3<double>::UnitY()).norm(), 1e-12);
}

TEST(SurfaceFile, NormalsDecideWhatTheFrontOfATriangleIs) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "two.obj", "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvn 0 0 -1\nvn 1 0 0.1\n"
                                        "f 1//1 2//1 3//1\nf 1//1 3//2 4//1\n");
  for (const bool smooth : {true, false}) {
    const Surface surface = readSurface(folder / "two.obj", smooth).surface;
    EXPECT_LT(areaVector(surface.mesh, 0).z(), 0);
    EXPECT_GT(areaVector(surface.mesh, 1).z(), 0); // one corner's normal does not contradict
  }
}

TEST(SurfaceFile, SaysWhatItCannotRead) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  for (const char* name : {"missing.glb", "missing.obj", "missing.ply", "flat.obj"}) try {
      readSurface(folder / name, true);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_NE(error.file().find(name), std::string::npos);
    }
}

} // namespace

namespace {

using namespace stage_example;

TEST(ObjectSection, ObjectsRefuseWhatIsNotThere) {
  expectError(with("material = \"clay\"", "material = \"clax\""), {"object[0].material", "clax", "clay"});
  expectError(with("radius = 0.5", "radius = 0"), {"object[0].radius"});
  expectError(with("segments = 16", "segments = 100000"), {"object[0].segments", "100000"});
  expectError(with("size = [2, 2, 0.1]", "size = [2, -2, 0.1]"), {"object[1].size"});
  const image::TemporaryFolder folder;
  const auto meshAt = [&](const std::string& name) {
    return with("type = \"sphere\"\nmaterial = \"clay\"\ncenter = [0, 0, 1]\nradius = 0.5\nsegments = 16",
                "type = \"mesh\"\nmaterial = \"clay\"\nfile = \"" + (folder / name).string() + "\"");
  };
  const auto error = [&](const std::string& name) { return image::errorOf([&] { parse(meshAt(name)); }); };
  EXPECT_NE(error("missing.obj").find("missing.obj"), std::string::npos);
  image::writeBytes(folder / "nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(error("nan.obj").find("nan.obj"), std::string::npos);
  EXPECT_NE(error("nan.obj").find("line 2"), std::string::npos) << error("nan.obj");
  image::writeBytes(folder / "good.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Stage one = parse(meshAt("good.obj"));
  image::writeBytes(folder / "good.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
  EXPECT_NE(one.hash, parse(meshAt("good.obj")).hash); // a stage is what its files hold
}

std::string withObject(const std::string& lines) {
  return with("type = \"sphere\"\nmaterial = \"clay\"\ncenter = [0, 0, 1]\nradius = 0.5\nsegments = 16",
              "material = \"clay\"\n" + lines);
}

TEST(ObjectSection, ShapesStandWhereTheyArePlaced) {
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

TEST(ObjectSection, ARingIsCopiesTurnedRoundZ) {
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

TEST(ObjectSection, ShapesRefuseWhatTheyCannotBe) {
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

TEST(ObjectSection, ObjectsRefuseToBeNothing) {
  const auto refuse = [](const std::string& lines, const std::vector<std::string>& parts) {
    expectError(withObject(lines), parts);
  };
  const auto ball = [](const std::string& center, const std::string& radius) {
    return "type = \"sphere\"\ncenter = " + center + "\nradius = " + radius + "\nsegments = 8\n";
  };
  // An object that carries fur.
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
  // Surfaces that are flat in part, or thin, are accepted.
  parse(withObject(ball("[0, 0, 0]", "1") + "displace = \"0*x-0.99\""));
  EXPECT_GT(parse(withObject(ball("[1e6, 0, 0]", "1"))).objects[0].surface.mesh.triangles.size(), 0u);
}

TEST(ObjectSection, TheInterfacesOfTheMugCloseWhatTheyHold) {
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

} // namespace

} // namespace surflect::stage
