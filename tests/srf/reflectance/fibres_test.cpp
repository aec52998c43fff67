#include "srf/reflectance/fibres.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numbers>

namespace surflect::reflectance {
namespace {

using std::numbers::pi;

// Angle between two lines.
double betweenLines(Angle a, Angle b) { return std::abs(std::remainder(a.radians() - b.radians(), pi)); }

SurfelFrame frameAt(const Vec3<double>& normal, double turn) {
  const Mat3<double> turned =
      turnFromZ(normal) * Eigen::AngleAxisd(turn, Vec3<double>::UnitZ()).toRotationMatrix();
  return SurfelFrame(turned.cast<float>());
}

// Brushed surfels on a sphere: fibres along the parallels, frames turned at random.
struct BrushedSphere {
  std::vector<Point3<AcquisitionSpace>> places;
  std::vector<SurfelFrame> frames;
  std::vector<Angle> fibres; // in each frame
  PhotographArrays captured;
};

BrushedSphere brushedSphere(const planted::Material& material, size_t surfels, size_t photographs,
                            unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(0, 2 * pi);
  BrushedSphere sphere;
  while (sphere.places.size() < surfels) {
    const Vec3<double> normal = randomUnit(random);
    if (std::abs(normal.z()) > 0.7) continue; // not about the poles
    const SurfelFrame frame = frameAt(normal, angle(random));
    const Vec3<float> along =
        frame.matrix().transpose() * Vec3<double>(-normal.y(), normal.x(), 0).cast<float>();
    sphere.places.push_back(assume<Point3<AcquisitionSpace>>(normal));
    sphere.frames.push_back(frame);
    sphere.fibres.push_back(Angle::fromRadians(std::atan2(along.y(), along.x())));
    planted::addSurfel(sphere.captured, material, planted::randomGain(random), photographs, random,
                       planted::aboutNormal(sphere.fibres.back().radians()));
  }
  return sphere;
}

TEST(CarriedAngle, IsThatOfTheRotationByTheShortestArc) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const SurfelFrame from = frameAt(randomUnit(random), 1), to = frameAt(randomUnit(random), 2);
    const Mat3<float> a = from.matrix(), b = to.matrix();
    if (a.col(2).dot(b.col(2)) < -0.9f) continue;
    const Vec3<float> u = Eigen::Quaternionf::FromTwoVectors(a.col(2), b.col(2)) * Vec3<float>(a.col(0));
    const SurfelFrame turned = turnedFrame(to, carriedAngle(from, to));
    EXPECT_LT((turned.matrix().col(0) - u).norm(), 1e-4f);
    EXPECT_LT(std::abs(carriedAngle(from, from).radians()), 1e-6);
  }
}

TEST(Patches, EachSurfelBelongsToTheNearestOfSpreadCentres) {
  std::mt19937 random(2);
  std::vector<Point3<AcquisitionSpace>> places;
  for (int s = 0; s < 500; ++s) places.push_back(assume<Point3<AcquisitionSpace>>(randomUnit(random)));
  const Patches patches = patchesOf(places, 20);
  ASSERT_EQ(patches.centres.size(), 20u);
  const auto distance = [&](size_t a, size_t b) { return (places[a].raw() - places[b].raw()).norm(); };
  for (size_t s = 0; s < places.size(); ++s)
    for (const uint32_t centre : patches.centres)
      EXPECT_LE(distance(s, patches.centres[patches.of[s]]), distance(s, centre));
  EXPECT_EQ(patchesOf(std::span(places).first(3), 9).centres.size(), 3u);
}

TEST(MeanLine, TakesOppositeDirectionsAsOneAndTurnsWithThem) {
  const std::vector<Angle> lines{Angle::fromDegrees(10), Angle::fromDegrees(200), Angle::fromDegrees(-165)};
  const std::vector<float> weights{1, 2, 1};
  const Angle mean = meanLine(lines, weights);
  std::vector<Angle> further;
  for (const Angle line : lines) further.push_back(Angle::fromRadians(line.radians() + 1));
  EXPECT_LT(betweenLines(meanLine(further, weights), Angle::fromRadians(mean.radians() + 1)), 1e-9);
  EXPECT_GT(mean.degrees(), 10);
  EXPECT_LT(mean.degrees(), 20);
}

TEST(Fibres, AreThePlantedOnes) {
  const BrushedSphere sphere = brushedSphere(planted::kBrushed, 400, 60, 3);
  const Photographs photographs = sphere.captured.view();
  const Patches patches = patchesOf(sphere.places, 25);
  const auto first = highlightFibres(photographs, sphere.frames, patches, planted::kWhite);
  const auto refined =
      refinedFibres({{17, 17, 3, 3}}, photographs, sphere.frames, patches, first, {.white = planted::kWhite});
  const auto angles = fibreAngles(sphere.places, sphere.frames, patches, refined);
  double squares = 0, squaresAtFirst = 0;
  const auto anglesAtFirst = fibreAngles(sphere.places, sphere.frames, patches, first);
  for (size_t s = 0; s < angles.size(); ++s) {
    squares += std::pow(betweenLines(angles[s], sphere.fibres[s]), 2);
    squaresAtFirst += std::pow(betweenLines(anglesAtFirst[s], sphere.fibres[s]), 2);
  }
  const auto degrees = [&](double sum) {
    return Angle::fromRadians(std::sqrt(sum / static_cast<double>(angles.size()))).degrees();
  };
  EXPECT_LT(degrees(squaresAtFirst), 6);
  EXPECT_LT(degrees(squares), 4);
}

TEST(Fibres, OfAnIsotropicSurfaceAreWeak) {
  const auto strengthOf = [](const planted::Material& material) {
    const BrushedSphere sphere = brushedSphere(material, 200, 60, 4);
    const Patches patches = patchesOf(sphere.places, 10);
    const Photographs photographs = sphere.captured.view();
    double sum = 0;
    for (const Fibre& fibre :
         refinedFibres({{17, 17, 3, 3}}, photographs, sphere.frames, patches,
                       highlightFibres(photographs, sphere.frames, patches, planted::kWhite),
                       {.white = planted::kWhite}))
      sum += fibre.strength / 10;
    return sum;
  };
  const double brushed = strengthOf(planted::kBrushed), glossy = strengthOf(planted::kGlossy);
  EXPECT_GT(brushed, 5 * glossy);
}

TEST(Fibres, AreTheSameForAnyNumberOfThreads) {
  const BrushedSphere sphere = brushedSphere(planted::kBrushed, 60, 20, 5);
  const Patches patches = patchesOf(sphere.places, 6);
  const auto run = [&] {
    const Photographs photographs = sphere.captured.view();
    std::vector<double> angles;
    for (const Angle angle :
         fibreAngles(sphere.places, sphere.frames, patches,
                     refinedFibres({{9, 9, 3, 3}}, photographs, sphere.frames, patches,
                                   highlightFibres(photographs, sphere.frames, patches, planted::kWhite),
                                   {.white = planted::kWhite})))
      angles.push_back(angle.radians());
    return angles;
  };
  const auto many = run();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(run(), many);
}

} // namespace
} // namespace surflect::reflectance
