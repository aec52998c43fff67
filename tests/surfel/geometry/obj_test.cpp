#include "surfel/geometry/obj.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/patience.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect {
namespace {

std::filesystem::path objWith(std::string_view content) {
  static const image::TemporaryFolder folder; // of this process: tests run side by side
  const auto path = folder / "content.OBJ";
  writeFileAtomically(path, content);
  return path;
}

TriangleMesh parsedMesh(std::string_view content) { return parseObj(content); }

std::string objComplaint(std::string_view content) {
  try {
    parsedMesh(content);
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

constexpr std::string_view corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
using Triangles = std::vector<std::array<uint32_t, 3>>;
const Triangles kSquareTriangles = {{0, 1, 2}, {0, 2, 3}};

std::string withCorners(std::string_view faces) {
  std::string text(corners);
  text.append(faces);
  return text;
}

TEST(Obj, ConvexPolygonsBecomeFans) {
  const TriangleMesh mesh = parsedMesh(withCorners("f 1 2 3 4\n"));
  EXPECT_EQ(mesh.triangles, kSquareTriangles);
  ASSERT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.positions[2].raw(), Vec3<float>(1, 1, 0));
  EXPECT_EQ(parsedMesh("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5").triangles,
            (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(Obj, ConcavePolygonsAreCutUnlessAskedForAsFans) {
  const std::string dart = "f 1 2 3 4\nv 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\n"; // vertices come later
  EXPECT_EQ(parseObj(dart).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  const std::string turned = "v 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nvt 0 0\nvt 0 1\nf 2/1 3/1 4/2 1/1\n";
  EXPECT_EQ(parseObj(turned).triangles.size(), 2u);
  for (size_t t = 0; t < 2; ++t) EXPECT_GT(areaVector(parseObj(turned), t).z(), 0);
  EXPECT_EQ(parseObj(turned, {.faces = Faces::asFans}).triangles, (Triangles{{1, 2, 3}, {1, 3, 0}}));
  const TexturedMesh textured = parseTexturedObj(turned);
  for (size_t t = 0; t < 2; ++t) EXPECT_GT(areaVector(textured.mesh, t).z(), 0);
}

TEST(Obj, CornersMayCountFromTheEndAndCarryTextureAndNormal) {
  for (const std::string_view face : {"f -4 -3 -2 -1", "f 1/9 2/8 3/7 4/6", "f 1//9 2//8 3//7 4//6",
                                      "f 1/1/1 2/2/2 3/3/3 4/4/4", "f -4/-4/-4 +2 -2//-1 4"})
    EXPECT_EQ(parsedMesh(withCorners(face)).triangles, kSquareTriangles) << face;
  // -1 is the last vertex so far, not of the file.
  EXPECT_EQ(parsedMesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n").triangles, (Triangles{{0, 1, 2}}));
  // A positive number may name a vertex still to come.
  EXPECT_EQ(parsedMesh("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").triangles, (Triangles{{0, 1, 2}}));
}

TEST(Obj, CommentsBlanksContinuationsAndOtherKeywordsDoNotMatter) {
  const TriangleMesh mesh = parsedMesh(
      "# a square\r\nmtllib a.mtl\r\n\r\no square\r\nv\t0 0 \\\r\n 0 # first\r\nv 1 0 0 1.0 0.5 0.5 0.5\r\n"
      "vn 0 0 1\r\nvt 0 0\r\n  v 1e0 +1 0\r\nv 0 1 0\r\ns off\r\nusemtl x\r\nf 1 2 \\\r\n3 4");
  EXPECT_EQ(mesh.triangles, kSquareTriangles);
  EXPECT_EQ(mesh.positions[2].raw(), Vec3<float>(1, 1, 0));
}

TEST(Obj, TrianglesWithoutAreaStayAsStoredAndGoFromTheMesh) {
  const auto path = objWith("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
  EXPECT_EQ(readMeshAsStored(path).triangles.size(), 2u);
  EXPECT_EQ(readMesh(path).triangles, (Triangles{{0, 1, 2}})); // nor does the third vertex stay
  EXPECT_THROW(readMesh(objWith("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")), Error);
}

TEST(Obj, AnOriginIsSubtractedBeforeCoordinatesAreRounded) {
  const auto path =
      objWith("v 500000.125 4600000.0625 30\nv 500001 4600000 30\nv 500000 4600001 30\nf 1 2 3\n");
  EXPECT_EQ(readMesh(path, {.origin = {500000, 4600000, 30}}).positions[0].raw(),
            Vec3<float>(0.125f, 0.0625f, 0));
}

TEST(Obj, ComplaintsNameTheFile) {
  const auto path = objWith("v 1");
  try {
    readMesh(path);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.what(), path.string() + ": line 1.v: found 1, expected three coordinates");
  }
}

TEST(Obj, ComplaintsNameTheLine) {
  const std::string four(corners);
  EXPECT_EQ(objComplaint(four + "f 1 2 5\n"), "line 5: found 5, expected a vertex of 1..4");
  EXPECT_EQ(objComplaint(four + "f 1 2 0\n"), "line 5: found 0, expected a vertex of 1..4 or -1..-4");
  EXPECT_EQ(objComplaint(four + "f 1 2 -5\n"), "line 5: found -5, expected a vertex of 1..4 or -1..-4");
  EXPECT_EQ(objComplaint(four + "f 1 2 -9223372036854775808"),
            "line 5: found -9223372036854775808, expected a vertex of 1..4 or -1..-4");
  EXPECT_EQ(objComplaint(four + "f 1 2 99999999999999999999"),
            "line 5: found '99999999999999999999', expected a vertex number");
  EXPECT_EQ(objComplaint(four + "\n\nf 1 \\\n2 x"), "line 7: found 'x', expected a vertex number");
  EXPECT_EQ(objComplaint(four + "f 1 2"), "line 5.f: found 2, expected at least three corners");
  EXPECT_EQ(objComplaint("v 1 2"), "line 1.v: found 2, expected three coordinates");
  EXPECT_EQ(objComplaint("v 1 2 1e99"), "line 1.v: found 1 2 1e99, expected finite coordinates");
  EXPECT_EQ(objComplaint("v 1 2 3x"), "line 1: found '3x', expected a number");
}

TEST(Obj, EveryDamagedByteGivesAMeshOrAnErrorOfOneLine) {
  std::mt19937 random(1);
  const std::string whole = withCorners("f 1/1/1 2 3//4 \\\n 4\nf -1 -2 -3 # end\n");
  int meshes = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = whole;
    for (int k = 0; k < 2; ++k) text[random() % text.size()] = static_cast<char>(random());
    try {
      const TriangleMesh mesh = parsedMesh(text);
      ++meshes;
      for (const auto& triangle : mesh.triangles)
        for (const uint32_t corner : triangle) ASSERT_LT(corner, mesh.positions.size());
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(meshes, 1000);
}

TEST(Obj, ReadingAMeshStopsWhereverItIsAskedTo) {
  constexpr int vertices = 10000;
  std::string text;
  for (int i = 0; i < vertices; ++i) text += "v " + std::to_string(i) + (i % 2 ? " 1 0\n" : " 0 0\n");
  for (int i = 1; i + 2 <= vertices; ++i)
    text += "f " + std::to_string(i) + ' ' + std::to_string(i + 1) + ' ' + std::to_string(i + 2) + '\n';
  const auto path = objWith(text);
  EXPECT_EQ(readMesh(path).triangles.size(), vertices - 2u);
  expectStopsWhenAsked([&](const Progress& progress) { readMesh(path, {}, progress); },
                       3 * vertices / 1024); // of statements, of faces, of triangles
}

TEST(Obj, VerticesAreSplitWhereATextureHasASeam) {
  // A square whose diagonal is a seam: two of its corners have two texture coordinates.
  const TexturedMesh mesh = parseTexturedObj(
      withCorners("vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.25\nvt 0.75 0\nf 1/1 2/2 3/3\nf 1/4 3/5 4/-3\n"));
  EXPECT_EQ(mesh.mesh.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(mesh.corner, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_EQ(mesh.mesh.positions[0].raw(), mesh.mesh.positions[3].raw());
  EXPECT_EQ(mesh.textureCoordinates[3], Vec2<double>(0.5, 0.25));
  EXPECT_EQ(mesh.textureCoordinates[5], Vec2<double>(1, 1)); // -3 of five
}

TEST(Obj, ATexturedFileWithoutSeamsIsThePlainOne) {
  const std::string text = withCorners("vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
  const TexturedMesh textured = parseTexturedObj(text);
  EXPECT_EQ(textured.mesh.triangles, parsedMesh(text).triangles);
  EXPECT_EQ(textured.mesh.positions, parsedMesh(text).positions);
}

TEST(Obj, AFaceWithACornerWithoutTextureLiesAtTheTexturesOrigin) {
  const TexturedMesh mesh = parseTexturedObj(withCorners("vt 0.5 1\nf 1/1 2/1 3/1\nf 1 3/1 4/1\n"));
  EXPECT_EQ(mesh.mesh.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(mesh.corner, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  for (size_t i = 0; i < 6; ++i)
    EXPECT_EQ(mesh.textureCoordinates[i], i < 3 ? Vec2<double>(0.5, 1) : Vec2<double>(0, 0));
  EXPECT_TRUE(parseTexturedObj(withCorners("vt 0 0\nf 1 2 3/1\n")).textureCoordinates.empty());
}

TEST(Obj, VerticesAreSplitWhereNormalsDiffer) {
  // Folded along its diagonal: two corners have two normals, and one of them two texture coordinates, too.
  const TexturedMesh mesh = parseTexturedObj(withCorners("vn 0 0 2\nvn 1 0 0\nvt 0 0\nvt 1 0\n"
                                                         "f 1/1/1 2/1/1 3/1/1\nf 1/1/-1 3/2/2 4/1/2\n"));
  EXPECT_EQ(mesh.mesh.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(mesh.corner, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  for (size_t i = 0; i < 6; ++i)
    EXPECT_EQ(mesh.normals[i], i < 3 ? Vec3<double>(0, 0, 2) : Vec3<double>(1, 0, 0));
  const TexturedMesh bare = parseTexturedObj(withCorners("vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n"));
  EXPECT_EQ(bare.mesh.triangles, kSquareTriangles);
  EXPECT_EQ(bare.normals, std::vector<Vec3<double>>(4, {0, 0, 1}));
  EXPECT_TRUE(bare.textureCoordinates.empty());
  const TexturedMesh some = parseTexturedObj(withCorners("vn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n"));
  EXPECT_EQ(some.normals[2], Vec3<double>(0, 0, 1));
  EXPECT_EQ(some.normals[5], Vec3<double>(0, 0, 0)); // none is none
}

TEST(Obj, WrongTextureCoordinatesAreRefusedWhereTheyAreAskedFor) {
  const auto complaint = [](std::string_view faces) {
    try {
      parseTexturedObj(withCorners(faces));
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no complaint");
  };
  EXPECT_EQ(complaint("vt 0 0\nf 1/1 2/2 3/1\n"), "line 6: found 2, expected a texture coordinate of 1..1");
  EXPECT_EQ(complaint("vt 0 0\nf 1/1 2/-2 3/1\n"),
            "line 6: found -2, expected a texture coordinate of 1..1 or -1..-1");
  EXPECT_EQ(complaint("vt nan 0\n"), "line 5.vt: found nan 0, expected finite coordinates");
  EXPECT_EQ(complaint("vt\n"), "line 5.vt: found none, expected a coordinate");
  EXPECT_EQ(complaint("vn 0 0 1\nf 1//1 2//2 3//1\n"), "line 6: found 2, expected a normal of 1..1");
  EXPECT_EQ(complaint("vn 0 inf 0\n"), "line 5.vn: found 0 inf 0, expected finite coordinates");
  EXPECT_EQ(complaint("vn 0 1\n"), "line 5.vn: found 2, expected three coordinates");
}

} // namespace
} // namespace surflect
