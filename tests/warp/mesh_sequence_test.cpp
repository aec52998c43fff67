#include "warp/mesh_sequence.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/warp/meshes.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

namespace surflect::warp {
namespace {

// A torus at rest, and as it is at the frames given: moved by one along x for each frame.
class MeshSequenceTest : public ::testing::Test {
protected:
  MeshSequenceTest() { writeObj(rest, mesh); }

  void writeKey(const std::string& name, double shift) const {
    TriangleMesh key = mesh;
    for (auto& p : key.positions) p = p + Direction3<AcquisitionSpace>(static_cast<float>(shift), 0, 0);
    writeObj(folder / name, key);
  }
  double shiftAt(double frame) const {
    const Vec3<double> x(0.1, 0.2, 0.3);
    return (MeshSequence(rest, folder / "cage.##.obj").at(frame)->position(x) - x)[0];
  }
  std::string complaint(const std::string& pattern = "cage.##.obj", double frame = 1) const {
    try {
      MeshSequence(rest, folder / pattern).at(frame);
    } catch (const Error& error) {
      return std::filesystem::path(error.file()).filename().string() + ": " + error.what();
    }
    return "no complaint";
  }

  image::TemporaryFolder folder;
  std::filesystem::path rest = folder / "rest.obj";
  TriangleMesh mesh = torus(8, 5);
};

TEST_F(MeshSequenceTest, KeysAreMetAndVerticesGoStraightBetweenThem) {
  writeKey("cage.02.obj", 2);
  writeKey("cage.05.obj", -1);
  writeKey("cage.100.obj", 100);
  EXPECT_NEAR(shiftAt(2), 2, 1e-6);
  EXPECT_NEAR(shiftAt(5), -1, 1e-6);
  EXPECT_NEAR(shiftAt(3), 1, 1e-6);
  EXPECT_NEAR(shiftAt(4.5), -0.5, 1e-6);
  EXPECT_NEAR(shiftAt(100), 100, 1e-5);
  EXPECT_NEAR(shiftAt(0), 2, 1e-6);
  EXPECT_NEAR(shiftAt(-7), 2, 1e-6);
  EXPECT_NEAR(shiftAt(500), 100, 1e-5);
}

TEST_F(MeshSequenceTest, AFaceMayBecomeConcave) {
  image::writeBytes(rest, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  image::writeBytes(folder / "cage.01.obj", "v 0 0 0\nv 0.3 0.5 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  EXPECT_EQ(complaint(), "no complaint");
}

TEST_F(MeshSequenceTest, OnlyFilesOfTheNameAreKeys) {
  writeKey("cage.02.obj", 2);
  for (const char* other : {"cage.1.obj", "cage.003.obj", "cage.04.obj.bak", "xcage.05.obj", "cage.0x.obj",
                            "cage.-6.obj", "cage..obj", "cage.9999999999.obj"})
    writeKey(other, 50);
  for (const double frame : {1, 3, 4, 5, 6, 7}) EXPECT_NEAR(shiftAt(frame), 2, 1e-6) << frame;
}

TEST_F(MeshSequenceTest, FilesOfAnotherPaddingAreNamed) {
  writeKey("cage.7.obj", 1);
  EXPECT_NE(complaint("cage.####.obj").find("none, but cage.7.obj: write one # for each digit"),
            std::string::npos)
      << complaint("cage.####.obj");
  EXPECT_EQ(complaint("cage.#.obj"), "no complaint");
}

TEST_F(MeshSequenceTest, WhatDoesNotFitTheRestMeshIsAnErrorThatNamesFileAndField) {
  EXPECT_NE(complaint().find("cage.##.obj: found none, expected files of this name"), std::string::npos);
  EXPECT_NE(complaint("cage.obj").find("expected a name such as"), std::string::npos);
  EXPECT_NE(complaint("a#b#.obj").find("expected a name such as"), std::string::npos);
  EXPECT_NE(complaint("nowhere/a#.obj").find("cannot list the folder"), std::string::npos);
  writeKey("cage.01.obj", 1);
  EXPECT_EQ(complaint(), "no complaint");

  const TriangleMesh whole = mesh;
  mesh.positions.emplace_back(0.f, 0.f, 0.f);
  writeKey("cage.01.obj", 1);
  EXPECT_NE(complaint().find("cage.01.obj: vertices: found 41, expected 40 as at rest"), std::string::npos);
  mesh = whole;
  mesh.triangles.pop_back();
  writeKey("cage.01.obj", 1);
  EXPECT_NE(complaint().find("cage.01.obj: triangles: found 79, expected 80 as at rest"), std::string::npos);
  mesh = whole;
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  writeKey("cage.01.obj", 1);
  EXPECT_NE(complaint().find("cage.01.obj: triangle[7]: "), std::string::npos);
  mesh = whole;
  writeKey("cage.01.obj", 1);
  std::ofstream(folder / "cage.09.obj") << "v 1 x 3\n"; // a later key stops too, before the first frame
  EXPECT_NE(complaint().find("cage.09.obj: line 1"), std::string::npos);
  std::ofstream(folder / "cage.01.obj") << "v 1 x 3\n";
  EXPECT_NE(complaint().find("cage.01.obj: line 1"), std::string::npos);
  std::filesystem::remove(rest);
  EXPECT_EQ(complaint().substr(0, 10), "rest.obj: ");
}

TEST_F(MeshSequenceTest, ItsHashIsThatOfTheFilesContents) {
  writeKey("cage.01.obj", 1);
  const auto hash = [&] { return MeshSequence(rest, folder / "cage.##.obj").contentHash(); };
  const uint64_t first = hash();
  writeKey("cage.01.obj", 1);
  EXPECT_EQ(hash(), first);
  writeKey("cage.01.obj", 1.5);
  const uint64_t second = hash();
  EXPECT_NE(second, first);
  writeKey("cage.02.obj", 1.5);
  EXPECT_NE(hash(), second);
}

} // namespace
} // namespace surflect::warp
