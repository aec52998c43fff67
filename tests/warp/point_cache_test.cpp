#include "warp/point_cache.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/warp/meshes.h"
#include "tests/warp/point_caches.h"
#include "warp/mesh_sequence.h"
#include "warp/motion.h"

#include <gtest/gtest.h>

#include <limits>

namespace surflect::warp {
namespace {

using Poses = std::vector<std::vector<Vec3<double>>>;

class PointCacheTest : public ::testing::Test {
protected:
  // The torus bent more and more.
  WarpPointer bendAt(double frame) const {
    const BendMotion motion{{1, 0, 0}, {0, 1, 0}, {}, Track::expression("9*frame"), 1};
    return evaluateAt(motion, {0, frame, 0});
  }
  Poses bent(int count) const {
    Poses poses(static_cast<size_t>(count));
    for (int frame = 0; frame < count; ++frame)
      for (const auto& x : positionsOf(mesh))
        poses[static_cast<size_t>(frame)].push_back(bendAt(frame)->position(x));
    return poses;
  }
  std::string complaint(const std::string& bytes) const {
    image::writeBytes(folder / "a.cache", bytes);
    try {
      MeshSequence::ofCache(rest, folder / "a.cache");
    } catch (const Error& error) {
      const std::string line = error.what();
      return line.substr(line.find("a.cache"));
    }
    return "no complaint";
  }

  image::TemporaryFolder folder;
  TriangleMesh mesh = torus(24, 12);
  std::filesystem::path rest = folder / "rest.obj";
  PointCacheTest() { writeObj(rest, mesh); }
};

TEST_F(PointCacheTest, MddAndPc2GiveTheMotionOfTheSameObjFiles) {
  constexpr int kFrames = 5;
  constexpr double kFps = 24;
  const Poses poses = bent(kFrames);
  std::vector<double> seconds;
  for (int frame = 0; frame < kFrames; ++frame) {
    TriangleMesh key = mesh;
    for (size_t i = 0; i < key.positions.size(); ++i)
      key.positions[i] = assume<Point3<AcquisitionSpace>>(poses[static_cast<size_t>(frame)][i]);
    writeObj(folder / ("cage." + std::to_string(frame) + ".obj"), key);
    seconds.push_back(frame / kFps);
  }
  image::writeBytes(folder / "a.mdd", mddBytes(seconds, poses));
  image::writeBytes(folder / "a.pc2", pc2Bytes(0, 1, poses));
  const MeshSequence files(rest, folder / "cage.#.obj");
  const MeshSequence mdd = MeshSequence::ofCache(rest, folder / "a.mdd"),
                     pc2 = MeshSequence::ofCache(rest, folder / "a.pc2");
  double largest = 0, fromBend = 0;
  for (const double frame : {-1.0, 0.0, 1.0, 2.25, 3.5, 4.0, 9.0}) {
    const WarpPointer wanted = files.at(frame), first = mdd.at(frame / kFps), second = pc2.at(frame);
    for (const auto& x : positionsOf(torus(7, 5))) {
      const Vec3<double> y = wanted->position(x);
      largest = std::max({largest, (first->position(x) - y).norm(), (second->position(x) - y).norm()});
      if (frame == 4) fromBend = std::max(fromBend, (y - bendAt(frame)->position(x)).norm());
    }
  }
  RecordProperty("largest", std::to_string(largest * 1e6));
  RecordProperty("from_bend", std::to_string(fromBend));
  EXPECT_LT(largest, 1.6e-8);
  EXPECT_LT(fromBend, 0.016); // what a cage of this fineness blurs
}

TEST_F(PointCacheTest, Pc2CountsFramesFromItsFirstBySamples) {
  image::writeBytes(folder / "a.pc2", pc2Bytes(10, 2.5, bent(3)));
  const PointCache cache(folder / "a.pc2", mesh.positions.size());
  EXPECT_EQ(cache.format(), PointCache::Format::pc2);
  EXPECT_EQ(cache.times(), (std::vector<double>{10, 12.5, 15}));
}

TEST_F(PointCacheTest, PositionsComeBackToTheBit) {
  Poses poses = bent(2);
  for (auto& pose : poses)
    for (auto& x : pose) x = x.cast<float>().cast<double>();
  for (const std::string& bytes : {mddBytes({-0.5, 3}, poses), pc2Bytes(1, 1, poses)}) {
    image::writeBytes(folder / "a", bytes);
    const PointCache cache(folder / "a", mesh.positions.size());
    for (size_t sample = 0; sample < 2; ++sample) EXPECT_EQ(cache.positions(sample), poses[sample]);
  }
}

TEST_F(PointCacheTest, EveryTruncationIsRefused) {
  mesh = torus(3, 3);
  writeObj(rest, mesh);
  for (const std::string& whole : {mddBytes({0, 1}, bent(2)), pc2Bytes(0, 1, bent(2))}) {
    EXPECT_EQ(complaint(whole), "no complaint");
    for (size_t size = 0; size < whole.size(); ++size)
      EXPECT_NE(complaint(whole.substr(0, size)), "no complaint") << size;
    EXPECT_NE(complaint(whole + '\0').find("bytes of 2 samples of 9 points"), std::string::npos);
  }
}

TEST_F(PointCacheTest, WhatCannotBeIsNamed) {
  const auto complains = [&](const std::string& bytes, const std::string& of) {
    EXPECT_NE(complaint(bytes).find(of), std::string::npos) << complaint(bytes);
  };
  const Poses poses = bent(2);
  const auto patched = [](std::string bytes, size_t at, const std::string& with) {
    return bytes.replace(at, with.size(), with);
  };
  const std::string mdd = mddBytes({0, 1}, poses), pc2 = pc2Bytes(0, 1, poses);
  const std::string none(4, '\0');
  complains(patched(mdd, 0, std::string("\x80\0\0\0", 4)), "expected 7430293422088 bytes of 2147483648");
  complains(patched(mdd, 4, std::string("\x80\0\0\0", 4)),
            "points: found 2147483648, expected 288 as at rest");
  complains(patched(mdd, 0, none), "samples: found 0");
  complains(patched(pc2, 28, std::string("\0\0\0\x80", 4)), "bytes of 2147483648 samples");
  complains(patched(pc2, 16, std::string("\0\0\0\x80", 4)), "points: found 2147483648");
  complains(patched(pc2, 12, std::string("\2\0\0\0", 4)), "version: found 2, expected 1");
  complains(pc2Bytes(0, 0, poses), "frames per sample: found 0");
  complains(mddBytes({1, 1}, poses), "time[1]: found 1, expected seconds that rise");
  Poses broken = poses;
  broken[1][17][2] = std::numeric_limits<double>::quiet_NaN();
  complains(mddBytes({0, 1}, broken), "sample[1].point[17]: found nan");
  broken[1][17][2] = std::numeric_limits<double>::infinity();
  complains(pc2Bytes(0, 1, broken), "sample[1].point[17]: found inf");
}

TEST_F(PointCacheTest, ExportsInOtherAxesAreRefused) {
  const auto with = [&](auto turn) {
    Poses poses = bent(2);
    for (auto& pose : poses)
      for (auto& x : pose) x = turn(x);
    return complaint(pc2Bytes(0, 1, poses));
  };
  EXPECT_EQ(with([](const Vec3<double>& x) { return x; }), "no complaint");
  EXPECT_NE(with([](const Vec3<double>& x) {
              return Vec3<double>(x[0], x[2], -x[1]);
            }).find("sample[0]: found its points as (x, z, -y), y up, expected the rest mesh's axes"),
            std::string::npos);
  EXPECT_NE(with([](const Vec3<double>& x) { return Vec3<double>(x[0], x[2], x[1]); }).find("sample[0]"),
            std::string::npos);
  EXPECT_EQ(with([](const Vec3<double>& x) -> Vec3<double> { return 1.1 * x; }), "no complaint"); // a pose
}

TEST_F(PointCacheTest, ItsHashIsThatOfTheFile) {
  const auto hashOf = [&](const std::string& bytes) {
    image::writeBytes(folder / "a", bytes);
    return MeshSequence::ofCache(rest, folder / "a").contentHash();
  };
  const Poses poses = bent(2);
  Poses other = poses;
  other[1][0][0] += 0.1;
  const uint64_t hash = hashOf(mddBytes({0, 1}, poses));
  EXPECT_EQ(hashOf(mddBytes({0, 1}, poses)), hash);
  EXPECT_NE(hashOf(mddBytes({0, 1}, other)), hash);
  EXPECT_NE(hashOf(mddBytes({0, 2}, poses)), hash);
}

} // namespace
} // namespace surflect::warp
