#include "warp/skeletal_rig.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/warp/gltf_files.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

#include <fstream>

namespace surflect::warp {
namespace {

class RigTest : public ::testing::Test {
protected:
  std::filesystem::path write(const GltfMaker& maker) const {
    const std::filesystem::path path = folder / "rig.glb";
    std::ofstream(path, std::ios::binary) << maker.glb();
    return path;
  }
  // Near the tube, its ends included.
  Vec3<double> nearby() {
    const double angle = randomBetween(-3.2, 3.2, random), radius = randomBetween(0.2, 0.4, random);
    return {radius * std::cos(angle), radius * std::sin(angle), randomBetween(0, 3, random)};
  }

  std::mt19937 random{1};
  image::TemporaryFolder folder;
};

TEST_F(RigTest, AtRestItMovesNothing) {
  const WarpPointer warp = Rig(write(tubeFile()), "Turn").at(0);
  for (int i = 0; i < 300; ++i) {
    const Vec3<double> x = nearby();
    EXPECT_LT((warp->position(x) - x).norm(), 1e-14);
    EXPECT_LT((*warp->jacobian(x) - Mat3<double>::Identity()).norm(), 1e-12);
  }
}

TEST_F(RigTest, AtRestIsWhereTheNodesAreUnmovedNotWhereTheSkinWasBound) {
  GltfMaker maker = tubeFile();
  maker.document["nodes"][0]["translation"] = {5, 0, 0};
  const WarpPointer warp = Rig(write(maker), "").at(0);
  const Vec3<double> x = nearby() + Vec3<double>(5, 0, 0);
  EXPECT_LT((warp->position(x) - x).norm(), 1e-14);
}

TEST_F(RigTest, ARigidlyMovedRootMovesAllSpaceSo) {
  GltfMaker maker = tubeFile();
  const double r = std::sqrt(0.5);
  auto& sampler = maker.document["animations"][0]["samplers"][0];
  sampler["output"] = maker.addFloats("VEC4", 4, {0, 0, 0, 1, r, 0, 0, r});
  maker.document["animations"][0]["channels"] = {
      {{"sampler", 0}, {"target", {{"node", 0}, {"path", "rotation"}}}}};
  const WarpPointer warp = Rig(write(maker), "Turn").at(1);
  const WarpPointer turn = rigidWarp({1, 0, 0}, Angle::fromDegrees(45), {0, 0, 0}, Vec3<double>::Zero());
  for (int i = 0; i < 300; ++i) {
    const Vec3<double> x = i % 2 ? nearby() : 3 * randomVector(random);
    EXPECT_LT((warp->position(x) - turn->position(x)).norm(), 2e-7); // keys are single precision
    EXPECT_LT((*warp->jacobian(x) - *turn->jacobian(x)).norm(), 2e-7);
  }
}

// The field is smoother than the skin by second order of its edges.
TEST_F(RigTest, VerticesComeToWhereTheSkinHasThemAsItGetsFiner) {
  const auto error = [&](int rings, int sides) {
    const auto path = write(tubeFile(rings, sides));
    const WarpPointer warp = Rig(path, "Turn").at(0.8);
    const GltfFile file = readGltf(path);
    const auto rest = pose(file.skeleton, {}, 0),
               posed = pose(file.skeleton, file.animations[0].channels, 0.8);
    double sum = 0;
    for (size_t i = 0; i < rest.size(); ++i) sum += (warp->position(rest[i]) - posed[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(rest.size()));
  };
  const double coarse = error(20, 12), fine = error(80, 48);
  EXPECT_LT(coarse, 0.02);
  EXPECT_LT(fine, coarse / 8);
}

TEST_F(RigTest, ItsJacobianIsThatOfItsPosition) {
  const WarpPointer warp = Rig(write(tubeFile()), "").at(1.5);
  for (int i = 0; i < 300; ++i) {
    const Vec3<double> x = nearby();
    const Mat3<double> differences = centralDifferences(*warp, x, Mat3<double>::Identity(), 1e-6);
    EXPECT_LT((differences - *warp->jacobian(x)).norm(), 1e-8);
  }
}

TEST_F(RigTest, TheAnimationIsTheOneNamedOrTheOnlyOne) {
  GltfMaker maker = tubeFile();
  const auto complaint = [&](const std::string& animation) -> std::string {
    try {
      const Rig rig(write(maker), animation);
    } catch (const Error& error) {
      return error.what() + error.file().size() + 2;
    }
    return "no complaint";
  };
  EXPECT_EQ(complaint(""), "no complaint");
  EXPECT_EQ(complaint("Turn"), "no complaint");
  EXPECT_EQ(complaint("Wave"), "animation: found \"Wave\", expected one of \"Turn\"");
  maker.document["animations"].push_back(maker.document["animations"][0]);
  maker.document["animations"][1]["name"] = "Wave";
  EXPECT_EQ(complaint("Wave"), "no complaint");
  EXPECT_EQ(complaint(""), "animation: found no name, expected one of \"Turn\", \"Wave\"");
  // Faults of another animation do not matter.
  maker.document["animations"][1]["samplers"][0]["interpolation"] = "CURVE";
  EXPECT_EQ(complaint("Turn"), "no complaint");
  EXPECT_EQ(complaint("Wave"), "animations[1].samplers[0].interpolation: found \"CURVE\", expected LINEAR, "
                               "STEP or CUBICSPLINE");
  maker.document.erase("animations");
  EXPECT_EQ(complaint(""), "animation: found no name, expected a file with an animation");
}

} // namespace
} // namespace surflect::warp
