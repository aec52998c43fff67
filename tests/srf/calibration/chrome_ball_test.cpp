#include "srf/calibration/chrome_ball.h"

#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <numbers>

namespace surflect::calibration {
namespace {

using World = AcquisitionSpace;

capture::Camera<World> cameraAt(const Vec3<double>& direction) {
  return studio::cameraFrom<World>(direction, 200); // at a distance of 4
}

// Positions on the rim of a ball in a camera's axes: of points where rays touch it.
std::vector<capture::Pixel> rimOf(const capture::Lens& lens, const Ball& ball) {
  const double distance = ball.center.norm(), sine = ball.radius / distance,
               cosine = std::sqrt(1 - sine * sine);
  const Vec3<double> axis = ball.center / distance, u = axis.unitOrthogonal(), v = axis.cross(u);
  std::vector<capture::Pixel> rim;
  for (int i = 0; i < 40; ++i) {
    const double angle = 2 * std::numbers::pi * i / 40;
    const Vec3<double> ray = cosine * axis + sine * (std::cos(angle) * u + std::sin(angle) * v);
    rim.push_back(*capture::project(lens, assume<Point3<CameraSpace, double>>(ray)));
  }
  return rim;
}

TEST(ChromeBall, OfAnOutlineIsTheBall) {
  capture::Lens lens = cameraAt({0, 0, 1}).lens;
  const Ball ball{{0.5, -0.4, -4}, 0.6};
  for (const double k1 : {0.0, -0.05}) { // the outline is an ellipse that the lens bends
    lens.k1 = k1;
    const auto found = ballOfOutline(lens, rimOf(lens, ball), ball.radius);
    ASSERT_TRUE(found);
    EXPECT_LT((found->center - ball.center).norm(), 3.6e-14);
  }
  EXPECT_FALSE(ballOfOutline(lens, std::vector<capture::Pixel>(11, {3, 4})));
}

// A holder, and holes of the coverage where highlights are.
TEST(ChromeBall, IsNotMovedByAFifthOfTheOutline) {
  const capture::Lens lens = cameraAt({0, 0, 1}).lens;
  const Ball ball{{0.5, -0.4, -4}, 0.6};
  std::vector<capture::Pixel> rim = rimOf(lens, ball);
  const capture::Pixel middle = *capture::project(lens, assume<Point3<CameraSpace, double>>(ball.center));
  for (size_t i = 0; i < rim.size(); i += 5) {
    const double away = i % 2 == 0 ? 1.5 : 0.6;
    rim[i] = {middle.x + away * (rim[i].x - middle.x), middle.y + away * (rim[i].y - middle.y)};
  }
  const auto found = ballOfOutline(lens, rim, ball.radius);
  ASSERT_TRUE(found);
  EXPECT_LT((found->center - ball.center).norm(), 7.3e-14);
  EXPECT_LT(found->misfit, 5.4e-14);
}

TEST(ChromeBall, TellsHowFarAnOutlineIsFromABalls) {
  const capture::Lens lens = cameraAt({0, 0, 1}).lens;
  std::vector<capture::Pixel> ellipse, square;
  for (int i = 0; i < 80; ++i) {
    const double angle = 2 * std::numbers::pi * i / 80, x = std::cos(angle), y = std::sin(angle);
    const double most = std::max(std::abs(x), std::abs(y));
    ellipse.push_back({100 + 40 * x, 100 + 36 * y});
    square.push_back({100 + 40 * x / most, 100 + 40 * y / most});
  }
  // The radii of an ellipse differ by 5 % of their mean times a cosine.
  EXPECT_NEAR(ballOfOutline(lens, ellipse)->misfit, 0.05 / std::numbers::sqrt2 / 0.95, 0.00065);
  EXPECT_GT(ballOfOutline(lens, square)->misfit, 0.05);
}

TEST(ChromeBall, OfAnOrthographicOutlineHasTheRadiusOfTheCircle) {
  capture::Lens lens{.model = capture::Lens::Model::orthographic, .width = 100, .height = 100};
  lens.focalX = lens.focalY = 50;
  lens.centerX = lens.centerY = 50;
  std::vector<capture::Pixel> circle;
  for (int i = 0; i < 30; ++i) circle.push_back({60 + 20 * std::cos(i), 40 + 20 * std::sin(i)});
  const auto ball = ballOfOutline(lens, circle);
  ASSERT_TRUE(ball);
  EXPECT_NEAR(ball->radius, 0.4, 1e-15);
  EXPECT_LT((ball->center - Vec3<double>(0.2, 0.2, 0)).norm(), 1e-15);
  // Its middle mirrors what is behind the camera.
  const auto ray = mirrorRay(lens, *ball, {60, 40});
  ASSERT_TRUE(ray);
  EXPECT_LT((ray->towards - Vec3<double>(0, 0, 1)).norm(), 1.1e-15);
  EXPECT_FALSE(mirrorRay(lens, *ball, {10, 10}));
}

TEST(ChromeBall, MirrorsByTheLawOfReflection) {
  const capture::Lens lens = cameraAt({0, 0, 1}).lens;
  const Ball ball{{0.5, -0.4, -4}, 0.6};
  for (const double x : {110.0, 118.0, 125.0}) {
    const auto ray = mirrorRay(lens, ball, {x, 110});
    ASSERT_TRUE(ray) << x;
    const Vec3<double> n = (ray->from - ball.center) / ball.radius, toCamera = -ray->from.normalized();
    EXPECT_NEAR(n.norm(), 1, 1.8e-14);
    EXPECT_NEAR(n.dot(toCamera), n.dot(ray->towards), 5e-14);
    EXPECT_NEAR(n.dot(toCamera.cross(ray->towards)), 0, 4e-16); // all three in a plane
  }
}

TEST(ChromeBall, OfViewsHasItsPlaceAndRadius) {
  const Ball ball{{0.2, -0.1, 0.3}, 0.25};
  std::vector<capture::Camera<World>> cameras;
  std::vector<Ball> seen;
  for (const Vec3<double>& direction :
       {Vec3<double>(1, 0, 0.2), Vec3<double>(0, 1, 0.5), Vec3<double>(-1, 0.2, 1)}) {
    cameras.push_back(cameraAt(direction));
    const Ball inCamera{cameras.back().cameraFromWorld(assume<Point3<World, double>>(ball.center)).raw(),
                        ball.radius};
    seen.push_back(*ballOfOutline(cameras.back().lens, rimOf(cameras.back().lens, inCamera)));
  }
  const auto found = ballOfViews(cameras, seen);
  ASSERT_TRUE(found);
  EXPECT_LT((found->center - ball.center).norm(), 7.9e-14);
  EXPECT_NEAR(found->radius, ball.radius, 2e-14);
  EXPECT_LT(found->misfit, 1.5e-13);
  std::vector<Ball> moved = seen; // in the last view, by its radius
  moved[2].center += moved[2].center.unitOrthogonal();
  EXPECT_GT(ballOfViews(cameras, moved)->misfit, 0.2);
  const std::vector<capture::Camera<World>> same{cameras[0], cameras[0]};
  EXPECT_FALSE(ballOfViews(same, std::vector<Ball>{seen[0], seen[0]}));
}

TEST(ChromeBall, RaysMeetAtANearLampAndGiveADirectionToAFarOne) {
  std::mt19937 random(3);
  std::normal_distribution<double> error(0, 0.003);
  for (const double distance : {2.0, 200.0}) {
    const Vec3<double> lamp = distance * Vec3<double>(1, 2, 2) / 3;
    std::vector<MirrorRay> rays;
    for (const Vec3<double>& from : studio::spiral(8)) {
      const Vec3<double> start = 0.3 * from;
      rays.push_back(
          {start, ((lamp - start).normalized() + Vec3<double>(error(random), error(random), error(random)))
                      .normalized()});
    }
    const LampOfRays found = lampOfRays(rays);
    EXPECT_EQ(found.isNear, distance < 10);
    EXPECT_FALSE(lampOfRays(rays, false).isNear);
    EXPECT_LT(std::acos(found.towards.dot(lamp.normalized())), 0.0031);
    if (found.isNear) EXPECT_LT((found.place - lamp).norm(), 3 * found.errorOfDistance * distance);
  }
}

TEST(ChromeBall, HighlightsAreSmallAndBright) {
  image::Image luminance(40, 40, 1), coverage(40, 40, 1);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) {
      coverage.at(x, y)[0] = std::hypot(x - 20, y - 20) < 15 ? 1.f : 0.f;
      luminance.at(x, y)[0] =
          static_cast<float>(0.1 + std::exp(-std::pow(std::hypot(x - 22.25, y - 17.5), 2) / 2));
    }
  const auto found = highlightOf(luminance, coverage);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->x, 22.75, 0.1);
  EXPECT_NEAR(found->y, 18, 0.01);
  std::ranges::fill(luminance.values, 0.5f);
  EXPECT_FALSE(highlightOf(luminance, coverage));
  std::ranges::fill(luminance.values, 0.f);
  EXPECT_FALSE(highlightOf(luminance, coverage));
}

} // namespace
} // namespace surflect::calibration
