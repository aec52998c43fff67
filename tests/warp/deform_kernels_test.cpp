#include "warp/deform_kernels.h"

#include "surfel/cloud.h"
#include "tests/support/each_simd.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

namespace surflect::warp {
namespace {

constexpr int kCount = WarpBatch::capacity;

// Points of a cube of side 2 `reach` about `middle`, with any tangents.
WarpBatch randomBatch(double reach, const Vec3<double>& middle, std::mt19937& random) {
  WarpBatch b;
  b.count = kCount;
  for (int i = 0; i < kCount; ++i) {
    const Vec3<double> x = middle + reach * randomVector(random), u = randomVector(random),
                       v = randomVector(random);
    b.x[i] = x.x(), b.y[i] = x.y(), b.z[i] = x.z();
    b.ux[i] = u.x(), b.uy[i] = u.y(), b.uz[i] = u.z();
    b.vx[i] = v.x(), b.vy[i] = v.y(), b.vz[i] = v.z();
    b.determinant[i] = randomBetween(-2, 2, random);
  }
  return b;
}

using Numbers = double[WarpBatch::capacity];
constexpr auto numbersOf = [](auto& b) {
  return std::array{&b.x, &b.y, &b.z, &b.ux, &b.uy, &b.uz, &b.vx, &b.vy, &b.vz, &b.determinant};
};

bool haveSameBits(const WarpBatch& a, const WarpBatch& b) {
  const auto as = numbersOf(a), bs = numbersOf(b);
  for (size_t k = 0; k < as.size(); ++k)
    if (std::memcmp(*as[k], *bs[k], sizeof(Numbers)) != 0) return false;
  return true;
}

// Over the largest number of the kind: a coordinate of places, or of tangents, or a determinant.
double distance(const WarpBatch& a, const WarpBatch& b) {
  const auto as = numbersOf(a), bs = numbersOf(b);
  double worst = 0;
  for (const auto& [begin, end] : {std::array{0, 3}, {3, 9}, {9, 10}}) {
    double off = 0, largest = 0;
    for (int k = begin; k < end; ++k)
      for (int i = 0; i < a.count; ++i) {
        off = std::max(off, std::abs((*as[k])[i] - (*bs[k])[i]));
        largest = std::max(largest, std::abs((*as[k])[i]));
      }
    worst = std::max(worst, off / largest);
  }
  return worst;
}

// Links of a chain stretch what those before them left over, by up to 30 times here.
double allowed(const char* name) { return std::string_view(name) == "chain" ? 1e-10 : 3e-12; }

TEST(DeformKernels, AgreeWithEachWarpPointByPoint) {
  std::mt19937 random(1);
  for (const Simd simd : EachSimd())
    for (const auto& [name, make] : exactWarps)
      for (int trial = 0; trial < 50; ++trial) {
        const WarpPointer warp = make(random);
        WarpBatch b = randomBatch(trial % 2 == 0 ? 1 : 3, Vec3<double>::Zero(), random), expected = b;
        warp->carry(b);
        warp->Warp::carry(expected);
        EXPECT_LT(distance(expected, b), allowed(name)) << name << ' ' << nameOf(simd);
      }
}

TEST(DeformKernels, AgreeFarFromTheOriginToo) {
  std::mt19937 random(2);
  const Vec3<double> far(1000, -2000, 500);
  const auto angle = [&] { return Angle::fromRadians(randomBetween(-2, 2, random)); };
  for (const Simd simd : EachSimd())
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3<double> axis = randomUnit(random), direction = axis.cross(randomUnit(random)).normalized();
      Lattice lattice = randomLattice(random);
      lattice.least += far;
      lattice.most += far;
      for (const WarpPointer& warp :
           {rigidWarp(axis, angle(), far, randomVector(random)), twistWarp(axis, angle(), far),
            bendWarp(axis, direction, angle(), far), taperWarp(axis, 0.5, far),
            sineWarp({axis, direction, far, 0.3, 1.5, angle()}), latticeWarp(lattice)}) {
        WarpBatch b = randomBatch(1, far, random), expected = b;
        warp->carry(b);
        warp->Warp::carry(expected);
        EXPECT_LT(distance(expected, b), 3e-12) << nameOf(simd);
      }
    }
}

TEST(DeformKernels, Avx2AndAvx512GiveTheSameBits) {
  if (supportedSimd().back() != Simd::avx512) return;
  std::mt19937 random(3);
  for (const auto& [name, make] : exactWarps)
    for (int trial = 0; trial < 20; ++trial) {
      const WarpPointer warp = make(random);
      const WarpBatch before = randomBatch(1.5, Vec3<double>::Zero(), random);
      const auto carried = [&] {
        WarpBatch b = before;
        warp->carry(b);
        return b;
      };
      EXPECT_TRUE(haveSameBits(inSimd(Simd::avx2, carried), inSimd(Simd::avx512, carried))) << name;
    }
}

// Whatever is beside it, and whatever is in the lanes that do not count.
TEST(DeformKernels, APointDoesNotDependOnItsNeighbours) {
  std::mt19937 random(4);
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (const auto& [name, make] : exactWarps) {
      const WarpPointer warp = make(random);
      const WarpBatch all = randomBatch(1.5, Vec3<double>::Zero(), random);
      WarpBatch moved = all;
      warp->carry(moved);
      for (const int offset : {1, 3, 13, 100}) {
        WarpBatch some = randomBatch(5, Vec3<double>::Zero(), random);
        some.count = kCount - offset;
        const auto from = numbersOf(all);
        const auto expected = numbersOf(std::as_const(moved));
        const auto to = numbersOf(some);
        for (size_t k = 0; k < to.size(); ++k) std::copy_n(*from[k] + offset, some.count, *to[k]);
        warp->carry(some);
        for (size_t k = 0; k < to.size(); ++k)
          EXPECT_EQ(std::memcmp(*to[k], *expected[k] + offset, some.count * sizeof(double)), 0) << name;
      }
    }
}

// A wave along x that moves y, of one radian a unit: y becomes sin(x), the tangent x (1, cos(x)).
TEST(DeformKernels, SineAndCosineAreRightAtAnySize) {
  std::mt19937 random(5);
  const Vec3<double> x = Vec3<double>::UnitX(), y = Vec3<double>::UnitY(), zero = Vec3<double>::Zero();
  for (const Simd simd : EachSimd())
    for (const double reach : {1e-9, 1e-3, 1., 10., 1e4, 1e9})
      for (int trial = 0; trial < 100; ++trial) {
        WarpBatch b = randomBatch(reach, zero, random);
        const WarpBatch phi = b;
        for (int i = 0; i < kCount; ++i) b.y[i] = b.uy[i] = 0, b.ux[i] = 1;
        carrySine(x.data(), y.data(), zero.data(), 1, 1, 0, b);
        const double rounding = simd == Simd::scalar ? 0x1p-52 * reach : 0;
        for (int i = 0; i < kCount; ++i) {
          EXPECT_NEAR(b.y[i], std::sin(phi.x[i]), 4e-13 + rounding);
          EXPECT_NEAR(b.uy[i], std::cos(phi.x[i]), 4e-13 + rounding);
          EXPECT_LE(std::abs(b.y[i] - std::sin(phi.x[i])), 4e-13 * std::abs(phi.x[i]));
        }
      }
}

TEST(DeformKernels, AnglesWithoutDigitsStayFinite) {
  const Vec3<double> x = Vec3<double>::UnitX(), y = Vec3<double>::UnitY(), zero = Vec3<double>::Zero();
  std::mt19937 random(6);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    WarpBatch b = randomBatch(1, zero, random);
    const double large[] = {1e15, 1e16, 1e30, 1e300};
    for (int i = 0; i < kCount; ++i) b.x[i] = large[i % 4] * (i % 8 < 4 ? 1 : -1), b.y[i] = 0;
    b.x[kCount - 1] = std::nan("");
    carrySine(x.data(), y.data(), zero.data(), 1, 1, 0, b);
    for (int i = 0; i + 1 < kCount; ++i) EXPECT_LE(std::abs(b.y[i]), 1 + 1e-12);
    EXPECT_TRUE(std::isnan(b.y[kCount - 1]));
  }
}

// A taper along x scales y by e^x.
TEST(DeformKernels, ExponentialIsRightAsFarAsFloatsReach) {
  std::mt19937 random(7);
  const Vec3<double> x = Vec3<double>::UnitX(), zero = Vec3<double>::Zero();
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (const double reach : {1e-6, 1., 20., 255.}) {
      WarpBatch b = randomBatch(reach, zero, random);
      const WarpBatch before = b;
      for (double& y : b.y) y = 1;
      carryTaper(x.data(), 1, zero.data(), b);
      for (int i = 0; i < kCount; ++i)
        EXPECT_LE(std::abs(b.y[i] - std::exp(before.x[i])), 1e-12 * std::exp(before.x[i]));
    }
}

std::vector<Rodrigues> randomFrames(std::mt19937& random) {
  std::vector<Rodrigues> frames;
  for (int i = 0; i < kCount; ++i)
    frames.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(randomUnit(random))));
  return frames;
}

TEST(DeformKernels, BeginWithTheRestFramesToTheBit) {
  std::mt19937 random(8);
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (const int count : {1, 7, 8, 9, 100, kCount}) {
      std::vector<float> places(3 * kCount);
      for (float& x : places) x = static_cast<float>(randomBetween(-1, 1, random));
      const std::vector<Rodrigues> frames = randomFrames(random);
      WarpBatch b;
      beginBatch(places.data(), &frames[0].x, count, b);
      ASSERT_EQ(b.count, count);
      for (int i = 0; i < count; ++i) {
        const Mat3<double> r0 = rotationOf<double>(frames[i]);
        EXPECT_EQ(Vec3<double>(b.x[i], b.y[i], b.z[i]),
                  Vec3<float>(Vec3<float>::Map(&places[3 * i])).cast<double>());
        EXPECT_EQ(Vec3<double>(b.ux[i], b.uy[i], b.uz[i]), Vec3<double>(r0.col(0)));
        EXPECT_EQ(Vec3<double>(b.vx[i], b.vy[i], b.vz[i]), Vec3<double>(r0.col(1)));
        EXPECT_EQ(b.determinant[i], 1);
      }
    }
}

TEST(DeformKernels, FinishRoundsAndDoubtsWhatMayHaveNoFrame) {
  std::mt19937 random(9);
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (int trial = 0; trial < 100; ++trial) {
      WarpBatch b = randomBatch(1, Vec3<double>::Zero(), random);
      const double size = std::pow(10, randomBetween(-40, 40, random));
      for (int i = 0; i < kCount; ++i) {
        const double turn = std::pow(10, randomBetween(-9, 0, random)); // how far v is from along u
        b.vx[i] = b.ux[i] + turn * b.vx[i];
        b.vy[i] = b.uy[i] + turn * b.vy[i];
        b.vz[i] = b.uz[i] + turn * b.vz[i];
        for (auto* numbers : {&b.ux, &b.uy, &b.uz, &b.vx, &b.vy, &b.vz}) (*numbers)[i] *= size;
      }
      b.z[5] = 1e39;
      b.determinant[6] = std::nan("");
      float p[3 * kCount], u[3 * kCount], v[3 * kCount];
      int8_t handedness[kCount];
      uint32_t doubtful[kCount / 32];
      finishBatch(b, p, u, v, handedness, doubtful);
      int sure = 0;
      for (int i = 0; i < kCount; ++i) {
        EXPECT_EQ(p[3 * i], static_cast<float>(b.x[i]));
        EXPECT_EQ(u[3 * i + 1], static_cast<float>(b.uy[i]));
        EXPECT_EQ(v[3 * i + 2], static_cast<float>(b.vz[i]));
        EXPECT_EQ(handedness[i], b.determinant[i] < 0 ? -1 : 1);
        if ((doubtful[i / 32] >> i % 32 & 1) != 0) continue;
        ++sure;
        EXPECT_TRUE(i != 5 && i != 6);
        EXPECT_TRUE(polarFrame<float>(Vec3<float>::Map(u + 3 * i), Vec3<float>::Map(v + 3 * i)));
      }
      if (size > 1e-30 && size < 1e30) {
        EXPECT_GT(sure, kCount / 3);
      }
    }
}

} // namespace
} // namespace surflect::warp
