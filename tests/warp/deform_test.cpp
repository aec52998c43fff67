#include "warp/deform.h"

#include "surfel/cloud.h"
#include "tests/support/each_simd.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>

namespace surflect::warp {
namespace {

SurfelCloud randomCloud(size_t count, std::mt19937& random) {
  SurfelCloud cloud;
  for (size_t i = 0; i < count; ++i) {
    cloud.p0.push_back(assume<Point3<AcquisitionSpace>>(randomVector(random)));
    cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(randomUnit(random))));
  }
  cloud.radius.assign(count, 0.01f);
  cloud.coverage.assign(count, 1);
  return cloud;
}

Mat3<float> lookUpMatrix(const SurfelCloud& cloud, const DeformedCloud& deformed, size_t i) {
  const auto frame = polarFrame(deformed.u[i].raw(), deformed.v[i].raw());
  return LookUp<float>(rotationOf<float>(cloud.r0[i]), *frame, static_cast<float>(deformed.handedness[i]))
      .matrix();
}

double jacobianDeterminant(const Warp& warp, const Point3<AcquisitionSpace>& p0) {
  return warp.jacobian(p0.raw().cast<double>())->determinant();
}

template <class T> bool sameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(Deform, IdentityGivesTheCloudItself) {
  std::mt19937 random(1);
  const SurfelCloud cloud = randomCloud(1000, random);
  const DeformedCloud deformed = deform(cloud, *chainWarp({}));
  ASSERT_EQ(deformed.size(), cloud.size());
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Mat3<double> r0 = rotationOf<double>(cloud.r0[i]);
    EXPECT_EQ(deformed.p[i].raw(), cloud.p0[i].raw());
    EXPECT_EQ(deformed.u[i].raw(), Vec3<float>(r0.col(0).cast<float>()));
    EXPECT_EQ(deformed.v[i].raw(), Vec3<float>(r0.col(1).cast<float>()));
    EXPECT_EQ(deformed.handedness[i], Handedness::kept);
  }
}

TEST(Deform, LookUpUnderARigidWarpIsTheInverseRotation) {
  std::mt19937 random(2);
  const SurfelCloud cloud = randomCloud(1000, random);
  const WarpPointer warp = randomRigid(random);
  const Mat3<float> inverse = warp->jacobian({0, 0, 0})->transpose().cast<float>();
  const DeformedCloud deformed = deform(cloud, *warp);
  for (size_t i = 0; i < cloud.size(); ++i)
    EXPECT_LT((lookUpMatrix(cloud, deformed, i) - inverse).norm(), 6e-7f);
}

TEST(Deform, HandednessIsTheSignOfTheDeterminant) {
  std::mt19937 random(3);
  int mirrored = 0;
  for (const auto& [name, make] : exactWarps)
    for (int i = 0; i < 20; ++i) {
      const SurfelCloud cloud = randomCloud(20, random);
      const WarpPointer warp = make(random);
      const DeformedCloud deformed = deform(cloud, *warp);
      for (size_t k = 0; k < cloud.size(); ++k) {
        const bool flips = jacobianDeterminant(*warp, cloud.p0[k]) < 0;
        mirrored += flips;
        EXPECT_EQ(deformed.handedness[k], flips ? Handedness::mirrored : Handedness::kept) << name;
      }
    }
  EXPECT_GT(mirrored, 100);
}

TEST(Deform, AMirrorFlipsHandednessAndLookUpUndoesIt) {
  std::mt19937 random(4);
  const SurfelCloud cloud = randomCloud(500, random);
  for (const WarpPointer& warp : {scaleWarp({-1, 1, 1}, {0, 0, 0}), formulas("-x", "y", "z")}) {
    const DeformedCloud deformed = deform(cloud, *warp);
    for (size_t i = 0; i < cloud.size(); ++i) {
      EXPECT_EQ(deformed.handedness[i], Handedness::mirrored);
      const Mat3<float> mirror = Vec3<float>(-1, 1, 1).asDiagonal();
      EXPECT_LT((lookUpMatrix(cloud, deformed, i) - mirror).norm(), 8e-7f);
    }
  }
}

// Eq. 6 against the exact Jacobian, on the same surfels.
TEST(Deform, DifferencesAgreeWithTheExactJacobianToFloat) {
  std::mt19937 random(5);
  const SurfelCloud cloud = randomCloud(1000, random);
  const WarpPointer exact = twistWarp({0, 1, 0}, Angle::fromRadians(1.3), {0, 0, 0});
  const WarpPointer formula = formulas("x*cos(1.3*y) + z*sin(1.3*y)", "y", "z*cos(1.3*y) - x*sin(1.3*y)");
  const DeformedCloud a = deform(cloud, *exact), b = deform(cloud, *formula);
  for (size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_LT(length(a.p[i] - b.p[i]), 2e-7f);
    EXPECT_LT((a.u[i].raw() - b.u[i].raw()).norm(), 1.5e-8f);
    EXPECT_LT((a.v[i].raw() - b.v[i].raw()).norm(), 1.5e-8f);
    EXPECT_EQ(a.handedness[i], b.handedness[i]);
  }
}

// Bends by one radian for each `unit`, and does not know its Jacobian.
struct Ripple final : Warp {
  explicit Ripple(double sceneUnit) : unit(sceneUnit) {}
  Vec3<double> position(const Vec3<double>& x) const override {
    return x + unit * std::sin(x.y() / unit) * Vec3<double>::UnitX();
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>&) const override { return std::nullopt; }
  double unit;
};

TEST(Deform, FarAndTinyScenesHaveGoodTangentsToo) {
  std::mt19937 random(6);
  for (const double unit : {1e-6, 1., 1e6})
    for (const double offset : {0., 1000.}) {
      SurfelCloud cloud = randomCloud(200, random);
      for (auto& p0 : cloud.p0)
        p0 = assume<Point3<AcquisitionSpace>>(unit * (p0.raw().cast<double>().array() + offset).matrix());
      const DeformedCloud deformed = deform(cloud, Ripple(unit));
      for (size_t i = 0; i < cloud.size(); ++i) {
        const Vec3<double> u0 = rotationOf<double>(cloud.r0[i]).col(0);
        const Vec3<double> u = u0 + std::cos(cloud.p0[i].y() / unit) * u0.y() * Vec3<double>::UnitX();
        EXPECT_LT((deformed.u[i].raw().cast<double>() - u).norm(), 1.2e-7) << unit << ' ' << offset;
      }
    }
}

TEST(Deform, GivesTheSameBitsForAnyNumberOfThreads) {
  std::mt19937 random(7);
  const SurfelCloud cloud = randomCloud(20000, random);
  for (const WarpPointer& warp : {randomChain(random), formulas("x + 0.1*sin(6*y)", "y*exp(z)", "z")}) {
    std::vector<DeformedCloud> results;
    for (const int threads : {1, 2}) {
      tbb::task_arena arena(threads);
      results.push_back(arena.execute([&] { return deform(cloud, *warp); }));
    }
    for (const DeformedCloud& result : results) {
      EXPECT_TRUE(sameBits(result.p, results[0].p));
      EXPECT_TRUE(sameBits(result.u, results[0].u));
      EXPECT_TRUE(sameBits(result.v, results[0].v));
      EXPECT_TRUE(sameBits(result.handedness, results[0].handedness));
    }
  }
}

// A warp without its kernels, evaluated point by point.
struct PointByPoint final : Warp {
  explicit PointByPoint(const Warp& of) : warp(of) {}
  Vec3<double> position(const Vec3<double>& x) const override { return warp.position(x); }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override { return warp.jacobian(x); }
  const Warp& warp;
};

// Both round numbers of double precision: to the same float, or where these lie between two, its neighbour.
TEST(Deform, KernelsGiveWhatPointByPointGives) {
  std::mt19937 random(11);
  int same = 0, all = 0;
  for (const Simd simd : EachSimd())
    for (const auto& [name, make] : exactWarps)
      for (const double offset : {0., 5.}) {
        SurfelCloud cloud = randomCloud(1001, random); // no multiple of any group
        for (auto& p0 : cloud.p0)
          p0 = assume<Point3<AcquisitionSpace>>(Vec3<double>(p0.raw().cast<double>().array() + offset));
        const WarpPointer warp = make(random);
        const DeformedCloud a = deform(cloud, *warp), b = deform(cloud, PointByPoint(*warp));
        EXPECT_TRUE(sameBits(a.handedness, b.handedness)) << name;
        for (size_t i = 0; i < a.size(); ++i)
          for (const auto& [ours, theirs] :
               {std::pair(a.p[i].raw(), b.p[i].raw()), std::pair(a.u[i].raw(), b.u[i].raw()),
                std::pair(a.v[i].raw(), b.v[i].raw())}) {
            EXPECT_LT((ours - theirs).norm(), 1.3e-7f * theirs.norm()) << name << ' ' << nameOf(simd);
            same += ours == theirs;
            ++all;
          }
      }
  EXPECT_GT(same, 0.999 * all);
}

TEST(Deform, Avx2AndAvx512GiveTheSameBits) {
  if (supportedSimd().back() != Simd::avx512) return;
  std::mt19937 random(12);
  const SurfelCloud cloud = randomCloud(2000, random);
  for (const auto& [name, make] : exactWarps) {
    const WarpPointer warp = make(random);
    const auto deformed = [&] { return deform(cloud, *warp); };
    const DeformedCloud a = inSimd(Simd::avx2, deformed), b = inSimd(Simd::avx512, deformed);
    EXPECT_TRUE(sameBits(a.p, b.p) && sameBits(a.u, b.u) && sameBits(a.v, b.v)) << name;
  }
}

TEST(Deform, KernelsLeaveTheSameSurfelsDead) {
  std::mt19937 random(13);
  SurfelCloud cloud = randomCloud(1000, random);
  cloud.p0[3] = {std::nanf(""), 0, 0};
  cloud.p0[500] = {0, INFINITY, 0};
  int dead = 0;
  for (const Simd simd : EachSimd())
    for (const Vec3<double>& factors :
         {Vec3<double>(0, 1, 1), Vec3<double>(1e-6, 1, 1), Vec3<double>(1e-7, -1e-7, 1),
          Vec3<double>(1e-46, 1e-46, 1e-46), Vec3<double>(1e-44, 1e-44, 1e-44),
          Vec3<double>(1e30, 1e30, 1e30), Vec3<double>(-1e39, 1, 1)}) {
      const WarpPointer warp = chainOf(scaleWarp(factors, {0, 0, 0}), randomTwist(random));
      const DeformedCloud a = deform(cloud, *warp), b = deform(cloud, PointByPoint(*warp));
      for (size_t i = 0; i < cloud.size(); ++i) {
        EXPECT_EQ(a.handedness[i], b.handedness[i]) << factors.transpose() << " " << i << nameOf(simd);
        dead += a.handedness[i] == Handedness::dead;
        if (a.handedness[i] == Handedness::dead) {
          EXPECT_EQ(a.p[i], Point3<ObjectSpace>());
          EXPECT_EQ(a.u[i], Direction3<ObjectSpace>());
        }
      }
    }
  EXPECT_GT(dead, 1000);
}

TEST(Deform, SurfelsWithoutAValueOrAFrameAreDeadAndZero) {
  std::mt19937 random(8);
  const SurfelCloud cloud = randomCloud(1000, random);
  for (const auto& [x, y, z] : {std::array{"x + sqrt(y)", "y", "z"},         // not a number for y < 0
                                std::array{"y > 0 ? x : 1e300*x", "y", "z"}, // beyond float
                                std::array{"y > 0 ? x : 1", "y > 0 ? y : 1", "y > 0 ? z : 1"}}) { // one point
    const DeformedCloud deformed = deform(cloud, *formulas(x, y, z));
    for (size_t i = 0; i < cloud.size(); ++i) {
      const bool dead = cloud.p0[i].y() < 0;
      EXPECT_EQ(deformed.handedness[i] == Handedness::dead, dead) << x << cloud.p0[i].raw().transpose();
      if (dead) {
        EXPECT_EQ(deformed.p[i], Point3<ObjectSpace>());
        EXPECT_EQ(deformed.u[i], Direction3<ObjectSpace>());
        EXPECT_EQ(deformed.v[i], Direction3<ObjectSpace>());
      }
    }
  }
}

TEST(Deform, AliveSurfelsAlwaysHaveAFrame) {
  std::mt19937 random(9);
  const SurfelCloud cloud = randomCloud(2000, random);
  const DeformedCloud deformed = deform(cloud, *formulas("x*exp(20*y)", "y*exp(-20*x)", "z^3"));
  for (size_t i = 0; i < cloud.size(); ++i)
    if (deformed.handedness[i] != Handedness::dead) {
      EXPECT_TRUE(polarFrame(deformed.u[i].raw(), deformed.v[i].raw()));
    }
}

TEST(Deform, TellsWhetherAnyBitHasChanged) {
  std::mt19937 random(13);
  const SurfelCloud cloud = randomCloud(1000, random);
  const auto bent = twistWarp({0, 0, 1}, Angle::fromDegrees(20), {0, 0, 0});
  DeformedCloud deformed;
  EXPECT_TRUE(deformInto(cloud, *bent, {}, deformed));
  EXPECT_FALSE(deformInto(cloud, *bent, {}, deformed));
  const std::vector<Point3<ObjectSpace>> places = deformed.p;
  for (const size_t surfel : {size_t{0}, size_t{640}, size_t{999}}) {
    deformed.v[surfel] = deformed.v[surfel] + Direction3<ObjectSpace>(0, 0, 1e-3f);
    EXPECT_TRUE(deformInto(cloud, *bent, {}, deformed));
    EXPECT_FALSE(deformInto(cloud, *bent, {}, deformed));
  }
  EXPECT_TRUE(sameBits(deformed.p, places));
  EXPECT_TRUE(deformInto(cloud, *chainWarp({}), {}, deformed));
  EXPECT_TRUE(deformInto(randomCloud(1001, random), *chainWarp({}), {}, deformed));
}

TEST(Deform, AnEmptyCloudStaysEmpty) { EXPECT_EQ(deform(SurfelCloud{}, *chainWarp({})).size(), 0u); }

TEST(DifferenceStep, GrowsWithTheScene) {
  std::mt19937 random(10);
  SurfelCloud cloud = randomCloud(100, random);
  const double step = differenceStep(cloud);
  for (auto& p0 : cloud.p0) p0 = {1024 * p0.x(), 1024 * p0.y(), 1024 * p0.z()};
  EXPECT_DOUBLE_EQ(differenceStep(cloud) / step, 1024);
}

TEST(DifferenceStep, IsPositiveForEveryCloud) {
  SurfelCloud cloud;
  EXPECT_GT(differenceStep(cloud), 0);
  cloud.p0 = {{0, 0, 0}};
  EXPECT_GT(differenceStep(cloud), 0);
  cloud.p0 = {{5, 0, 0}, {5, 0, 0}};
  EXPECT_GT(differenceStep(cloud), 0);
  cloud.p0.push_back({std::nanf(""), 0, 0});
  EXPECT_TRUE(std::isfinite(differenceStep(cloud)));
}

} // namespace
} // namespace surflect::warp
