#include "srf/proxy/hull/silhouette_view.h"

#include "tests/srf/image/files.h"
#include "tests/srf/proxy/hull/shapes.h"

#include <cmath>
#include <random>

namespace surflect::hull {

namespace {

// The share of each pixel, by 16 x 16 samples, in which inside(x, y).
template <class Inside> image::Image covered(int width, int height, const Inside& inside) {
  image::Image alpha(width, height, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int s = 0; s < 256; ++s)
        alpha.at(x, y)[0] += inside(x + (s % 16 + 0.5) / 16, y + (s / 16 + 0.5) / 16) ? 1 / 256.f : 0;
  return alpha;
}

// Error of bilinear interpolation for an edge seen through a square pixel, largest if one pixel is covered
// and the next to 0.3; and samples of a sixteenth.
constexpr double kTolerance = 0.086 + 1 / 32.0;

TEST(Outline, OfAHalfPlaneIsItsDistanceAtAnyAngle) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 20; ++round) {
    const double angle = 2 * M_PI * unit(random), offset = 4 * unit(random) - 2;
    const auto distance = [&](double x, double y) {
      return (x - 16) * std::cos(angle) + (y - 12) * std::sin(angle) - offset;
    };
    const Outline outline(covered(32, 24, [&](double x, double y) { return distance(x, y) > 0; }));
    for (int i = 0; i < 200; ++i) {
      // Away from the border, beyond which the line goes on and the outline does not.
      const double x = 10 + 12 * unit(random), y = 8 + 8 * unit(random);
      EXPECT_NEAR(outline.signedDistance({x, y}), distance(x, y), kTolerance) << angle;
    }
  }
}

TEST(Outline, OfADiscIsItsDistance) {
  const auto distance = [](double x, double y) { return 11.3 - std::hypot(x - 20.2, y - 17.9); };
  const Outline outline(covered(40, 36, [&](double x, double y) { return distance(x, y) > 0; }));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> x(0.5, 39.5), y(0.5, 35.5);
  for (int i = 0; i < 2000; ++i) {
    const capture::Pixel pixel{x(random), y(random)};
    if (distance(pixel.x, pixel.y) > 6) continue; // bilinear cuts off the tip: 1 / (4 * 5.3) here
    EXPECT_NEAR(outline.signedDistance(pixel), distance(pixel.x, pixel.y), kTolerance + 0.05);
  }
  EXPECT_NEAR(outline.centroid().x, 20.2, 0.15);
  EXPECT_NEAR(outline.centroid().y, 17.9, 0.15);
}

TEST(Outline, MaskAndSignAreThoseOfAlphaAboveOneHalf) {
  const image::Image alpha = image::randomImage(33, 21, 1, 0, 1, 3);
  const Outline outline(alpha);
  EXPECT_EQ(outline.mask(), image::objectMask(alpha));
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x)
      EXPECT_EQ(outline.signedDistance({x + 0.5, y + 0.5}) > 0, alpha.at(x, y)[0] > 0.5f);
}

TEST(Outline, TheBorderOfTheImageIsNone) {
  // The object leaves the picture on the left.
  const Outline outline(covered(30, 10, [](double x, double) { return x < 20; }));
  for (const double x : {0.0, 0.5, 5.0, 19.0})
    EXPECT_NEAR(outline.signedDistance({x, 0.2}), 20 - std::max(x, 0.5), 1e-4);

  EXPECT_TRUE(outline.isCropped());
  EXPECT_FALSE(Outline(covered(9, 9, [](double x, double y) {
                 return std::hypot(x - 4.5, y - 4.5) < 3;
               })).isCropped());

  image::Image full(7, 5, 1);
  std::ranges::fill(full.values, 1.f);
  EXPECT_FALSE(Outline(full).isEmpty());
  EXPECT_EQ(Outline(full).signedDistance({0, 0}), 12);
  EXPECT_TRUE(Outline(image::Image(7, 5, 1)).isEmpty());
  EXPECT_EQ(Outline(image::Image(7, 5, 1)).signedDistance({3, 3}), -12);
}

TEST(Outline, ASinglePixelOrRowOfThemIsAnImageToo) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 4}, {4, 1}}) {
    image::Image alpha(width, height, 1);
    alpha.values[0] = 1;
    EXPECT_GT(Outline(alpha).signedDistance({0.5, 0.5}), 0);
  }
}

} // namespace

namespace {

using shapes::Point;

std::vector<SilhouetteView> sightsOfAllLenses() {
  auto cameras = shapes::camerasAround(4, 60);
  cameras[1] = shapes::orthographic(cameras[1]);
  cameras[2].lens.k1 = 0.2, cameras[2].lens.k2 = -0.3, cameras[2].lens.p1 = 0.01;
  cameras[3].lens.focalX = cameras[3].lens.focalY = 200; // crops
  return shapes::silhouetteViews(cameras, shapes::twoLobes());
}

TEST(SilhouetteView, AVoteOnABallHoldsForEachOfItsPoints) {
  const auto silhouetteViews = sightsOfAllLenses();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Vec3<double>(unit(random), unit(random), unit(random)); };
  std::array<int, 4> seen{};
  for (int round = 0; round < 4000; ++round) {
    const Ball ball{assume<Point>(5 * unit(random) * vector()), 0.3 * std::pow(unit(random), 2)};
    for (const SilhouetteView& silhouetteView : silhouetteViews) {
      const BallVote vote = voteOn(silhouetteView, ball);
      seen[0] += vote.votes, seen[1] += !vote.mayAgree, seen[2] += vote.inside, seen[3] += vote.outside;
      for (int i = 0; i < 20; ++i) {
        const auto distance = coneDistance(
            silhouetteView, assume<Point>(ball.center.raw() + ball.radius * vector().normalized() *
                                                                  std::cbrt(std::abs(unit(random)))));
        ASSERT_TRUE(distance || !vote.votes);
        ASSERT_TRUE(!distance || !(*distance > 0) || vote.mayAgree);
        ASSERT_TRUE(!vote.inside || !distance || *distance > 0);
        ASSERT_TRUE(!vote.outside || *distance < 0);
      }
    }
  }
  for (const int count : seen) EXPECT_GT(count, 300);
}

TEST(SilhouetteView, AProjectedBallIsNoLargerThanItsRadiusSays) {
  const auto silhouetteViews = sightsOfAllLenses();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vec3<double>(normal(random), normal(random), normal(random)); };
  for (const SilhouetteView& silhouetteView : silhouetteViews) {
    double largest = 0;
    for (int round = 0; round < 1000; ++round) {
      const Ball ball{assume<Point>(0.7 * vector()), 0.1};
      const double radius = projectedRadius(silhouetteView.camera, ball);
      const auto center = silhouetteView.camera.project(ball.center);
      if (!center || !std::isfinite(radius)) continue;
      for (int i = 0; i < 10; ++i) {
        const auto p =
            silhouetteView.camera.project(assume<Point>(ball.center.raw() + 0.1 * vector().normalized()));
        if (p) largest = std::max(largest, std::hypot(p->x - center->x, p->y - center->y) / radius);
      }
    }
    EXPECT_LE(largest, 1.000001);
    EXPECT_GE(largest, 0.5) << "a bound of no use";
  }
}

TEST(SilhouetteView, ConeDistanceIsTheDistanceToTheSphereSeen) {
  for (const bool isOrthographic : {false, true}) {
    auto camera = studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, 300);
    if (isOrthographic) camera = shapes::orthographic(camera);
    const SilhouetteView silhouetteView = shapes::sightOf(camera, shapes::matte(camera, shapes::sphere()), 0);
    const Vec3<double> back =
        camera.cameraFromWorld.inverse()(Direction3<CameraSpace, double>(0, 0, 1)).raw();
    const Vec3<double> aside = back.cross(Vec3<double>(0, 1, 0)).normalized();
    for (const double height : {0.9, 0.95, 1.02, 1.03}) {
      const double distance = *coneDistance(silhouetteView, assume<Point>(height * aside));
      // A cone's side leans: its distance is shorter than that at the equator by its cosine.
      const double slope = isOrthographic ? 1 : std::sqrt(1 - 1 / 16.0);
      const double equator = 1 / slope;
      EXPECT_NEAR(distance, equator - height, 0.001) << height;
    }
  }
}

TEST(SilhouetteView, AQuorumIsHalfOfTheImagesWithTheObjectAndTwoAtLeast) {
  auto cameras = shapes::camerasAround(9, 40);
  EXPECT_EQ(quorumOf(shapes::silhouetteViews(cameras, shapes::sphere())), 5u);
  for (size_t i = 0; i < 4; ++i) cameras[i].lens.centerX = 45; // shows only an edge
  EXPECT_EQ(quorumOf(shapes::silhouetteViews(cameras, shapes::sphere())), 3u);
  cameras.resize(2);
  EXPECT_EQ(quorumOf(shapes::silhouetteViews(cameras, shapes::sphere())), 2u);
}

TEST(SilhouetteView, ViewsAlongOneLineAreAnError) {
  auto camera = studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, 40);
  std::vector<capture::Camera<AcquisitionSpace>> cameras(3, shapes::orthographic(camera));
  EXPECT_NE(image::errorOf([&] {
              pointInView(shapes::silhouetteViews(cameras, shapes::sphere()));
            }).find("along one line"),
            std::string::npos);
}

TEST(SilhouetteView, ARegionThatIsNotMixedHasOneSign) {
  const auto silhouetteViews = shapes::silhouetteViews(shapes::camerasAround(9, 50), shapes::ring());
  const size_t quorum = quorumOf(silhouetteViews);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Vec3<double>(unit(random), unit(random), unit(random)); };
  std::array<int, 3> seen{};
  for (int round = 0; round < 3000; ++round) {
    const Ball ball{assume<Point>(vector()), 0.05};
    const Region region = classify(silhouetteViews, quorum, ball);
    ++seen[static_cast<size_t>(region)];
    if (region == Region::mixed) continue;
    for (int i = 0; i < 20; ++i) {
      const auto p = assume<Point>(ball.center.raw() + 0.05 * unit(random) * vector().normalized());
      ASSERT_EQ(hullDistance(silhouetteViews, quorum, p, 0.1) > 0, region == Region::inside);
    }
  }
  for (const int count : seen) EXPECT_GT(count, 30);
}

} // namespace

} // namespace surflect::hull
