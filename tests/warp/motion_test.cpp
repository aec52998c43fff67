#include "warp/motion.h"

#include "surfel/base/error.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

#include <numbers>

namespace surflect::warp {
namespace {

const Track3 yAxis{0, 3, 0}; // any length will do

std::string motionComplaint(const WarpMotion& motion) {
  try {
    evaluateAt(motion, {0, 12, 0});
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(Freeze, TwistsByTheAngleOverTheLength) {
  const TwistMotion motion{yAxis, {}, Track::keyframes({{0, 0}, {10, 90}}), 2};
  const WarpPointer warp = evaluateAt(motion, {0, 10, 0});
  EXPECT_LT((warp->position({1, 2, 0}) - Vec3<double>(0, 2, -1)).norm(), 2e-16);
  EXPECT_LT((evaluateAt(motion, {0, 0, 0})->position({1, 2, 0}) - Vec3<double>(1, 2, 0)).norm(), 1e-15);
}

// A rod of length 2 bent by 180 degrees ends beside its foot, at twice the radius 2/pi.
TEST(Freeze, BendsByTheAngleOverTheLengthTowardsTheDirectionAcross) {
  const BendMotion motion{yAxis, {1, 7, 0}, {}, 180, 2};
  const WarpPointer warp = evaluateAt(motion, {});
  EXPECT_LT((warp->position({0, 2, 0}) - Vec3<double>(4 / std::numbers::pi, 0, 0)).norm(), 2e-16);
}

TEST(Freeze, TakesEachParameterAtItsTime) {
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    const Vec3<double> x = randomVector(random);
    const ShotTime time{randomBetween(0, 2, random), 5, 0.5};
    const WarpPointer sine = evaluateAt(
        SineMotion{yAxis, {1, 0, 0}, {0, 1, 0}, Track::expression("t"), Track::expression("1 + t"), 30},
        time);
    const WarpPointer expected = sineWarp({.axis = {0, 1, 0},
                                           .direction = {1, 0, 0},
                                           .center = {0, 1, 0},
                                           .amplitude = time.t,
                                           .wavelength = 1 + time.t,
                                           .phase = Angle::fromDegrees(30)});
    EXPECT_EQ(sine->position(x), expected->position(x));

    const WarpPointer rigid =
        evaluateAt(RigidMotion{yAxis, {1, 0, 0}, Track::expression("90*t"), {0, 0, 2}}, time);
    EXPECT_EQ(rigid->position(x),
              rigidWarp({0, 1, 0}, Angle::fromDegrees(90 * time.t), {1, 0, 0}, {0, 0, 2})->position(x));

    const WarpPointer scale = evaluateAt(ScaleMotion{{Track::expression("t"), 2, -1}, {1, 1, 1}}, time);
    EXPECT_EQ(scale->position(x), scaleWarp({time.t, 2, -1}, {1, 1, 1})->position(x));
  }
}

TEST(Freeze, TapersByTheFactorAtTheLength) {
  const WarpPointer warp = evaluateAt(TaperMotion{yAxis, {0, 1, 0}, 0.25, 2}, {});
  EXPECT_LT((warp->position({1, 3, 0}) - Vec3<double>(0.25, 3, 0)).norm(), 1e-16);
  EXPECT_LT((warp->position({1, 2, 0}) - Vec3<double>(0.5, 2, 0)).norm(), 1e-15);
  EXPECT_EQ(motionComplaint(TaperMotion{yAxis, {}, Track::expression("12 - frame"), 1}),
            "factor: found 0, expected more than 0");
}

TEST(Freeze, ComplaintsNameTheParameter) {
  EXPECT_EQ(motionComplaint(TwistMotion{{0, 0, 0}, {}, 0, 1}),
            "axis: found length 0 at frame 12, expected a direction");
  EXPECT_EQ(motionComplaint(TwistMotion{yAxis, {}, 0, 0}), "length: found 0, expected another number");
  EXPECT_EQ(motionComplaint(TwistMotion{yAxis, {}, Track::expression("1/0"), 1}),
            "angle_deg: found inf at frame 12, expected a finite number");
  EXPECT_EQ(motionComplaint(SineMotion{yAxis, yAxis, {}, 1, 0, 0}),
            "wavelength: found 0, expected another number");
  EXPECT_EQ(motionComplaint(BendMotion{yAxis, {0, -2, 0}, {}, 1, 1}),
            "direction: found a direction along the axis, expected one that is not");
}

} // namespace
} // namespace surflect::warp
