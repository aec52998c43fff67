#include "render/stage/surface_file.h"

#include "tests/render/stage/surfaces.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(SurfaceFile, MeshesComeFromFilesSmoothOrFaceted) {
  const TemporaryFolder folder;
  writeBytes(folder / "tent.obj", "v 0 0 0\nv 1 0 1\nv 0 2 0\nv -1 0 1\nf 1 2 3\nf 1 3 4\n");
  const Surface smooth = readSurface(folder / "tent.obj", true),
                faceted = readSurface(folder / "tent.obj", false);
  EXPECT_EQ(smooth.mesh.positions.size(), 4u);
  EXPECT_LT((smooth.normals[0].raw() - Vec3<double>::UnitZ()).norm(), 1e-7); // both triangles alike
  EXPECT_EQ(faceted.mesh.positions.size(), 6u);
  EXPECT_LT(largestTilt(faceted), 1e-7);
  EXPECT_GT(largestTilt(smooth), 0.5);
}

} // namespace
} // namespace surflect
