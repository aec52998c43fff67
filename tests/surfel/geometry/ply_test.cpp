#include "surfel/geometry/ply.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/geometry/mesh.h"
#include "tests/srf/image/files.h"
#include "tests/support/patience.h"

#include <gtest/gtest.h>

#include <cstring>

namespace surflect {
namespace {

std::filesystem::path temporaryFile(const std::string& name) {
  static const image::TemporaryFolder folder; // of this process: tests run side by side
  return folder / name;
}

std::filesystem::path fileWith(std::string_view content) {
  const auto path = temporaryFile("content.ply");
  writeFileAtomically(path, content);
  return path;
}

constexpr std::string_view kSquare = "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\n"
                                     "property float x\nproperty float y\nproperty float z\n"
                                     "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                     "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

TEST(Ply, QuadsBecomeTwoTrianglesOfTheSameOrientation) {
  const auto mesh = readMesh(fileWith(kSquare));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  for (size_t t = 0; t < 2; ++t) EXPECT_EQ(areaVector(mesh, t), Vec3<double>(0, 0, 1));
}

TEST(Ply, ConcaveFacesAreCutAndUnusedVerticesLeftOut) {
  std::string text(kSquare);
  text.replace(text.find("1 1 0"), 5, "0.2 0.2 0"); // a dart, whose fan would lie on both sides of it
  text.replace(text.find("4 0 1 2 3"), 9, "4 1 2 3 0");
  const TriangleMesh mesh = readMesh(fileWith(text));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  for (size_t t = 0; t < 2; ++t) EXPECT_NEAR(areaVector(mesh, t)[2], 0.2, 1e-7);
  EXPECT_LT(areaVector(readMeshAsStored(fileWith(text), {.faces = Faces::asFans}), 0)[2], 0);

  text.replace(text.find("4 1 2 3 0"), 9, "3 0 1 3");
  EXPECT_EQ(readMesh(fileWith(text)).positions.size(), 3u);
  EXPECT_EQ(readMeshAsStored(fileWith(text)).positions.size(), 4u);
}

// The square with more properties of its vertices and its face.
std::string squareWith(const std::string& ofVertex, const std::array<std::string, 4>& values,
                       const std::string& ofFace = "", const std::string& list = "") {
  std::string text(kSquare);
  text.insert(text.find("element face"), ofVertex);
  text.insert(text.find("end_header"), ofFace);
  size_t at = text.find("end_header\n") + 11;
  for (const std::string& value : values) {
    at = text.find('\n', at);
    text.insert(at, ' ' + value);
    at += value.size() + 2;
  }
  text.insert(text.size() - 1, list);
  return text;
}

TEST(Ply, TextureCoordinatesAndNormalsComeByAllTheirNames) {
  for (const auto& [s, t] : {std::pair{"s", "t"}, std::pair{"u", "v"}, std::pair{"texture_u", "texture_v"}}) {
    const TexturedMesh mesh = readTexturedPly(fileWith(
        squareWith("property float " + std::string(s) + "\nproperty double " + t + "\nproperty uchar red\n",
                   {"0 0 255", "1 0 255", "1 0.5 255", "0 0.5 255"})));
    EXPECT_EQ(mesh.mesh.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
    ASSERT_EQ(mesh.textureCoordinates.size(), 4u) << s;
    EXPECT_EQ(mesh.textureCoordinates[2], Vec2<double>(1, 0.5));
    EXPECT_TRUE(mesh.normals.empty());
  }
  const TexturedMesh mesh = readTexturedPly(fileWith(squareWith(
      "property float nx\nproperty float ny\nproperty float nz\n", {"0 0 1", "0 1 0", "0 0 1", "nan 0 0"})));
  EXPECT_EQ(mesh.normals[1], Vec3<double>(0, 1, 0));
  EXPECT_EQ(mesh.normals[3], Vec3<double>(0, 0, 0)); // none
  EXPECT_TRUE(mesh.textureCoordinates.empty());
}

TEST(Ply, TextureCoordinatesOfFacesComeFirst) {
  const std::string ofVertex = "property float s\nproperty float t\n",
                    ofFace = "property list uchar float texcoord\n";
  const std::array<std::string, 4> values = {"0 0", "1 0", "1 1", "0 1"};
  const auto read = [&](const std::string& list) {
    return readTexturedPly(fileWith(squareWith(ofVertex, values, ofFace, list)));
  };
  EXPECT_EQ(read(" 8 0 0 0.5 0 0.5 0.5 0 0.5").textureCoordinates[2], Vec2<double>(0.5, 0.5));
  EXPECT_EQ(read(" 0").textureCoordinates[2], Vec2<double>(1, 1));
  EXPECT_NE(image::errorOf([&] {
              read(" 6 0 0 1 0 1 1");
            }).find("face[0].texcoord: found 6, expected 8 numbers, two a corner"),
            std::string::npos);
  EXPECT_EQ(readMesh(fileWith(squareWith(ofVertex, values, ofFace, " 6 0 0 1 0 1 1"))).triangles.size(), 2u);
}

TEST(Ply, AnOriginIsSubtractedBeforeCoordinatesAreRounded) {
  const auto mesh =
      readMesh(fileWith("ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
                        "property double z\nelement face 1\nproperty list uchar int vertex_indices\n"
                        "end_header\n500000.125 4600000.0625 30\n500001 4600000 30\n500000 4600001 30\n"
                        "3 0 1 2\n"),
               {.origin = {500000, 4600000, 30}});
  EXPECT_EQ(mesh.positions[0].raw(), Vec3<float>(0.125f, 0.0625f, 0));
}

TEST(Ply, StripsAlternateTheirWinding) {
  const auto mesh =
      readMesh(fileWith("ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                        "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
                        "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n9 0 1 2 3 4 -1 0 1 2\n"));
  ASSERT_EQ(mesh.triangles.size(), 4u);
  for (size_t t = 0; t < 4; ++t) EXPECT_GT(areaVector(mesh, t)[2], 0);
}

TEST(Ply, BothByteOrdersReadTheSame) {
  for (const bool big : {false, true}) {
    std::string text =
        std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement a 2\nproperty double d\nproperty ushort s\nproperty list uchar char l\nend_header\n";
    const auto append = [&](auto value) {
      std::string raw(sizeof value, 0);
      std::memcpy(raw.data(), &value, sizeof value);
      text += big ? std::string(raw.rbegin(), raw.rend()) : raw;
    };
    for (const double d : {1.25, -7.5}) {
      append(d);
      append(static_cast<uint16_t>(513));
      append(static_cast<uint8_t>(2));
      append(static_cast<int8_t>(-3));
      append(static_cast<int8_t>(4));
    }
    const auto ply = readPly(fileWith(text));
    EXPECT_EQ(ply.find("a")->scalars("d")[1], -7.5);
    EXPECT_EQ(ply.find("a")->scalars("s")[0], 513);
    EXPECT_EQ(ply.find("a")->find("l")->values, (std::vector<double>{-3, 4, -3, 4}));
  }
}

TEST(Ply, ColumnsComeBackAsWritten) {
  const auto path = temporaryFile("columns.ply");
  writePly(path, "vertex", std::vector<PlyColumn>{{"x", {1, 2.5f, -3}}, {"q", {0.1f, 1e30f, 7}}}, "test");
  const auto ply = readPly(path);
  EXPECT_EQ(ply.find("vertex")->scalars("x")[1], 2.5);
  EXPECT_EQ(ply.find("vertex")->scalars("q")[0], static_cast<double>(0.1f));
}

TEST(Ply, WrittenColumnsAreThoseOfAnyReader) {
  const auto path = temporaryFile("written.ply");
  writePly(path, "vertex", std::vector<PlyColumn>{{"x", {1, 2.5f, -3}}, {"q", {0.1f, 1e30f, 7}}}, "test");
  const std::string content = readFile(path);
  const std::string_view wanted[] = {"q", "x", "q"};
  const auto columns = parseWrittenPly(content, "vertex", wanted);
  ASSERT_TRUE(columns && columns->size() == 3);
  const PlyFile ply = parsePly(content);
  for (size_t c = 0; c < 3; ++c) {
    const auto values = ply.find("vertex")->scalars(wanted[c]);
    EXPECT_EQ(columns->at(c), std::vector<float>(values.begin(), values.end()));
  }
}

TEST(Ply, OtherFilesAreLeftToTheGeneralReader) {
  const std::string_view x[] = {"x"}, absent[] = {"x", "y"};
  const std::string format = "ply\nformat binary_little_endian 1.0\n",
                    two = format + "element vertex 2\nproperty float x\nend_header\n01234567";
  EXPECT_TRUE(parseWrittenPly(two, "vertex", x));
  EXPECT_FALSE(parseWrittenPly(two, "vertex", absent));
  EXPECT_FALSE(parseWrittenPly(two, "face", x));
  EXPECT_FALSE(parseWrittenPly(std::string_view(two).substr(0, two.size() - 1), "vertex", x));
  EXPECT_FALSE(parseWrittenPly(kSquare, "vertex", x));
  for (const std::string property : {"double x", "list float float x"})
    EXPECT_FALSE(parseWrittenPly(format + "element vertex 1\nproperty " + property + "\nend_header\n01234567",
                                 "vertex", x));
  EXPECT_FALSE(parseWrittenPly(format + "element vertex 0\nend_header\n", "vertex", {}));
  EXPECT_FALSE(parseWrittenPly(format + "element vertex 1\nproperty float x\nelement face 1\n"
                                        "property float y\nend_header\n01234567",
                               "vertex", x));
  EXPECT_THROW(parseWrittenPly("ply\n", "vertex", x), Error);
}

TEST(Ply, EveryTruncationIsRejectedWithTheFileName) {
  // The last number may lose its newline, nothing more.
  for (size_t length = 0; length + 2 < kSquare.size(); ++length) {
    try {
      readMesh(fileWith(kSquare.substr(0, length)));
      ADD_FAILURE() << "accepted " << length << " bytes";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("content.ply"), std::string::npos);
    }
  }
}

std::string complaintAbout(std::string_view from, std::string_view to) {
  std::string text(kSquare);
  text.replace(text.find(from), from.size(), to);
  try {
    readMesh(fileWith(text));
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(Ply, ComplaintsNameThePlace) {
  EXPECT_NE(complaintAbout("0 1 2 3", "0 1 2 9").find("face[0]: found 9"), std::string::npos);
  EXPECT_NE(complaintAbout("1 1 0", "1 x 0").find("vertex[2].y: found 'x', expected a number"),
            std::string::npos);
  EXPECT_NE(complaintAbout("1 1 0", "1 nan 0").find("vertex[2]: "), std::string::npos);
  EXPECT_NE(complaintAbout("vertex 4", "vertex 4000000000").find("vertex: found 4000000000"),
            std::string::npos);
  EXPECT_NE(complaintAbout("float z", "string z").find("header line 7"), std::string::npos);
  EXPECT_NE(complaintAbout("4 0 1 2 3", "99 0 1 2 3").find("face[0].vertex_indices"), std::string::npos);
}

TEST(Ply, TrianglesWithoutAreaAreLeftOut) {
  std::string text(kSquare);
  text.replace(text.find("1 1 0"), 5, "2 0 0"); // 0 1 2 now lie on a line
  EXPECT_EQ(readMesh(fileWith(text)).triangles.size(), 1u);
}

TEST(Ply, ReadingAMeshStopsWhereverItIsAskedTo) {
  constexpr int vertices = 40000;
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(vertices - 2) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < vertices; ++i) text += std::to_string(i) + (i % 2 ? " 1 0\n" : " 0 0\n");
  for (int i = 0; i + 2 < vertices; ++i)
    text += "3 " + std::to_string(i) + ' ' + std::to_string(i + 1) + ' ' + std::to_string(i + 2) + '\n';
  const auto path = fileWith(text);
  EXPECT_EQ(readMesh(path).triangles.size(), vertices - 2u);
  expectStopsWhenAsked([&](const Progress& progress) { readMesh(path, {}, progress); },
                       3 * vertices / 1024); // of vertices, of faces, of triangles
}

} // namespace
} // namespace surflect
