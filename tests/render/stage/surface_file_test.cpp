#include "render/stage/surface_file.h"

#include "render/stage/shapes.h"
#include "surfel/base/error.h"
#include "tests/render/stage/surfaces.h"
#include "tests/srf/image/files.h"
#include "tests/warp/gltf_files.h"

#include <gtest/gtest.h>

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
} // namespace surflect::stage
