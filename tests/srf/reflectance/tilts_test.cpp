#include "srf/reflectance/tilts.h"

#include "srf/reflectance/shared_reflectance.h"
#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>

namespace surflect::reflectance {
namespace {

Tilt randomTilt(std::mt19937& random, float most) {
  std::uniform_real_distribution<float> any(-most, most);
  const float u = any(random), v = any(random);
  return {u, v};
}

TEST(TiltRotation, TakesTheNormalToItsTiltByTheShortestArc) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Tilt tilt = randomTilt(random, 1);
    const Vec3<float> normal = Vec3<float>(tilt.u, tilt.v, 1).normalized();
    const Eigen::Quaternionf shortest = Eigen::Quaternionf::FromTwoVectors(Vec3<float>::UnitZ(), normal);
    EXPECT_LT((tiltRotation(tilt) - shortest.toRotationMatrix()).norm(), 1e-5f);
  }
  EXPECT_EQ(tiltRotation({}), Mat3<float>::Identity());
}

// Glossy surfels on a sphere, whose frames have normals that are off by a smooth field.
struct TiltedSphere {
  std::vector<Point3<AcquisitionSpace>> places;
  std::vector<SurfelFrame> frames;
  std::vector<Vec3<float>> normals; // true ones
  PhotographArrays photographs;

  TiltedSphere(float off, size_t surfels, size_t ofEach, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> angle(0, 6);
    while (places.size() < surfels) {
      const Vec3<float> n = randomUnit(random).cast<float>();
      const Vec3<float> error =
          off * Vec3<float>(std::sin(3 * n.y()), std::cos(3 * n.z()), std::sin(2 * n.x()));
      const Vec3<float> wrong = (n + error - error.dot(n) * n).normalized();
      const SurfelFrame frame(
          Mat3<float>(Eigen::Quaternionf::FromTwoVectors(Vec3<float>::UnitZ(), wrong).toRotationMatrix() *
                      planted::aboutNormal(angle(random))));
      const Vec3<float> inFrame = frame.matrix().transpose() * n;
      places.push_back(assume<Point3<AcquisitionSpace>>(n.cast<double>().eval()));
      frames.push_back(frame);
      normals.push_back(n);
      planted::addSurfel(
          photographs, planted::kGlossy, planted::randomGain(random), ofEach, random,
          Eigen::Quaternionf::FromTwoVectors(Vec3<float>::UnitZ(), inFrame).toRotationMatrix());
    }
  }

  SharedReflectance shared() const {
    return shareReflectance(photographs.view(), {places, frames},
                            {.white = planted::kWhite, .grid = {{17, 17, 3, 3}}, .mostTables = 1});
  }
  // Squared error of the normals, mean.
  double error(const SharedReflectance& shared) const {
    double sum = 0;
    for (size_t s = 0; s < normals.size(); ++s)
      sum += (tiltedFrame(frames[s], shared.tilts[s]).matrix().col(2) - normals[s]).squaredNorm();
    return sum / static_cast<double>(normals.size());
  }
};

TEST(Tilts, BringBackNormalsThatAreSevenDegreesOff) {
  const TiltedSphere sphere(0.12f, 600, 60, 2);
  SharedReflectance shared = sphere.shared();
  const double after = sphere.error(shared);
  shared.tilts.assign(shared.tilts.size(), {});
  EXPECT_GT(sphere.error(shared), 9 * after); // a third of the angle
}

TEST(Tilts, RightNormalsStayAsTheyAre) {
  const SharedReflectance shared = TiltedSphere(0, 300, 60, 3).shared();
  EXPECT_EQ(shared.tilts, std::vector<Tilt>(300));
}

// The tilt towards +z, which is the same in space whatever the frames.
TEST(Tilts, OfOtherSurfelsAreTheSameInSpace) {
  std::mt19937 random(4);
  const TiltedSphere from(0, 300, 0, 5), at(0, 40, 0, 6);
  const auto upwards = [](const SurfelFrame& frame) {
    const Vec3<float> up = 0.1f * frame.matrix().transpose().col(2);
    return Tilt{up.x(), up.y()};
  };
  std::vector<Tilt> tilts;
  for (const SurfelFrame& frame : from.frames) tilts.push_back(upwards(frame));
  const std::vector<Tilt> got = tiltsNear(from.places, from.frames, tilts, at.places, at.frames);
  for (size_t s = 0; s < got.size(); ++s) {
    const Tilt wanted = upwards(at.frames[s]);
    EXPECT_NEAR(got[s].u, wanted.u, 0.015);
    EXPECT_NEAR(got[s].v, wanted.v, 0.015);
  }
}

} // namespace
} // namespace surflect::reflectance
