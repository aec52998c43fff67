#include "render/surfels/query_kernel.h"

#include "render/surfels/frame.h"
#include "render/surfels/queries.h"
#include "tests/render/clouds.h"
#include "tests/support/each_simd.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace surflect::surfels {
namespace {

using testing::randomVector;
using testing::Rng;
using testing::uniform;

struct Scene {
  SurfelCloud rest;
  DeformedCloud deformed;
  std::vector<uint32_t> surfels; // a subset in random order
  capture::Camera<ObjectSpace> camera;
  std::vector<scene::ShotLight> lights;
};

// Tangents of random length, 1e-3 to 1e3, and angle, mirrored or not.
Scene randomScene(size_t count, Rng& random) {
  Scene scene;
  for (size_t i = 0; i < count; ++i) {
    testing::addSurfel(scene.rest, randomVector(random, 1), randomUnit(random));
    const auto tangent = [&] {
      return assume<Direction3<ObjectSpace>>(std::pow(10, uniform(random, -3, 3)) * randomUnit(random));
    };
    scene.deformed.p.push_back(assume<Point3<ObjectSpace>>(randomVector(random, 1)));
    scene.deformed.u.push_back(tangent());
    scene.deformed.v.push_back(tangent());
    scene.deformed.handedness.push_back(random() & 1 ? Handedness::kept : Handedness::mirrored);
    if (random() % 3 != 0) scene.surfels.push_back(static_cast<uint32_t>(i));
  }
  std::shuffle(scene.surfels.begin(), scene.surfels.end(), random);
  const Mat3<double> rotation = randomRotation(random);
  scene.camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -5)};
  for (int i = 0; i < 3; ++i) {
    const Rgb strength{float(i), 2, 0.5f};
    scene.lights.emplace_back(
        scene::ShotPointLight{assume<Point3<ObjectSpace, double>>(randomVector(random, 3)), strength});
    scene.lights.emplace_back(
        scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(randomUnit(random)), strength});
  }
  return scene;
}

weights::QueryBatch queries(const Scene& scene) {
  return queriesAt(scene.rest, scene.deformed, scene.surfels, scene.camera, scene.lights);
}

template <class T> bool sameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

// Compared with L and the lights computed for one surfel at a time.
TEST(QueryKernel, AnswerAsOneSurfelAfterTheOther) {
  Rng random(1);
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
      Scene scene = randomScene(1500, random);
      scene.camera.lens.model = model;
      const weights::QueryBatch batch = queries(scene);
      ASSERT_EQ(batch.size(), scene.surfels.size());
      ASSERT_EQ(batch.lights, scene.lights.size());
      const capture::Viewpoint viewpoint(scene.camera);
      for (size_t query = 0; query < batch.size(); ++query) {
        const size_t surfel = scene.surfels[query];
        const LookUp<double> lookUp = lookUpAt(scene.rest, scene.deformed, surfel);
        const auto p = scene.deformed.p[surfel].cast<double>();
        const auto off = [&](const Direction3<ObjectSpace, double>& d,
                             const Direction3<AcquisitionSpace>& found) {
          return (lookUp(d).raw() - found.raw().cast<double>()).cwiseAbs().maxCoeff();
        };
        EXPECT_LT(off(viewpoint.towards(p), batch.towardsView[query]), 3.1e-8); // rounding to float
        for (size_t l = 0; l < batch.lights; ++l) {
          const Rgb found = batch.irradiance[query * batch.lights + l];
          const auto& towards = batch.towardsLight[query * batch.lights + l];
          if (const auto* distant = std::get_if<scene::ShotDirectionalLight>(&scene.lights[l])) {
            EXPECT_LT(off(distant->towards, towards), 3.1e-8);
            EXPECT_EQ(found, distant->irradiance);
          } else {
            const auto& near = std::get<scene::ShotPointLight>(scene.lights[l]);
            const auto d = near.position - p;
            EXPECT_LT(off(normalized(d), towards), 3.1e-8);
            const Rgb expected = static_cast<float>(1 / dot(d, d)) * near.intensity;
            for (const auto& [a, b] :
                 {std::pair(expected.r, found.r), {expected.g, found.g}, {expected.b, found.b}})
              EXPECT_NEAR(a, b, 1.2e-7f * a);
          }
        }
      }
    }
}

TEST(QueryKernel, Avx2AndAvx512GiveTheSameBits) {
  if (supportedSimd().back() != Simd::avx512) return;
  Rng random(2);
  const Scene scene = randomScene(3000, random);
  const auto run = [&] { return queries(scene); };
  const weights::QueryBatch a = inSimd(Simd::avx2, run), b = inSimd(Simd::avx512, run);
  EXPECT_TRUE(sameBits(a.towardsView, b.towardsView));
  EXPECT_TRUE(sameBits(a.towardsLight, b.towardsLight));
  EXPECT_TRUE(sameBits(a.irradiance, b.irradiance));
}

TEST(QueryKernel, AQueryDoesNotDependOnItsNeighbours) {
  Rng random(3);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    Scene scene = randomScene(300, random);
    const weights::QueryBatch all = queries(scene);
    for (const size_t skipped : {1, 3, 190}) {
      Scene some = scene;
      some.surfels.erase(some.surfels.begin(), some.surfels.begin() + static_cast<ptrdiff_t>(skipped));
      const weights::QueryBatch rest = queries(some);
      for (size_t i = 0; i < rest.size(); ++i) {
        EXPECT_EQ(rest.towardsView[i], all.towardsView[i + skipped]);
        for (size_t l = 0; l < all.lights; ++l) {
          EXPECT_EQ(rest.towardsLight[i * all.lights + l], all.towardsLight[(i + skipped) * all.lights + l]);
          EXPECT_EQ(rest.irradiance[i * all.lights + l], all.irradiance[(i + skipped) * all.lights + l]);
        }
      }
    }
  }
}

TEST(QueryKernel, ALightOnASurfelGivesItNothing) {
  Rng random(4);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    Scene scene = randomScene(100, random);
    const size_t query = 13, surfel = scene.surfels[query];
    auto& light = std::get<scene::ShotPointLight>(scene.lights[2]);
    light.position = scene.deformed.p[surfel].cast<double>();
    const weights::QueryBatch batch = queries(scene);
    for (size_t i = 0; i < batch.size(); ++i) {
      EXPECT_EQ(batch.irradiance[i * batch.lights + 2] == Rgb(), i == query);
      EXPECT_NEAR(length(batch.towardsLight[i * batch.lights + 2]), 1, 2e-7f);
    }
  }
}

TEST(QueryKernel, AViewerOnASurfelIsSeenInSomeDirection) {
  Rng random(5);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    Scene scene = randomScene(100, random);
    const auto center = scene.deformed.p[scene.surfels[13]].cast<double>();
    scene.camera.cameraFromWorld = {Mat3<double>::Identity(), -center.raw()};
    ASSERT_EQ(scene.camera.center().raw(), center.raw());
    for (const auto& towards : queries(scene).towardsView) EXPECT_NEAR(length(towards), 1, 2e-7f);
  }
}

// L J keeps the direction of a line.
TEST(CarriedLines, KeepTheirAngleToTheTangents) {
  Rng random(8);
  const Scene scene = randomScene(500, random);
  std::vector<Angle> lines;
  for (size_t i = 0; i < scene.deformed.size(); ++i)
    lines.push_back(Angle::fromRadians(uniform(random, -4, 4)));
  const DeformedCloud carried = withCarriedLines(scene.deformed, lines);
  for (size_t i = 0; i < lines.size(); ++i) {
    const double angle = lines[i].radians();
    const Vec3<double> line = std::cos(angle) * scene.deformed.u[i].raw().cast<double>() +
                              std::sin(angle) * scene.deformed.v[i].raw().cast<double>();
    const Vec3<double> u = carried.u[i].raw().cast<double>(), v = carried.v[i].raw().cast<double>();
    EXPECT_NEAR(u.norm(), 1, 1e-6);
    EXPECT_NEAR(v.norm(), 1, 1e-6);
    EXPECT_NEAR(u.dot(v), 0, 1e-6);
    EXPECT_NEAR(line.normalized().dot(u), std::cos(angle), 1e-6);
    EXPECT_NEAR(line.normalized().dot(v), std::sin(angle), 1e-6);
  }
}

} // namespace
} // namespace surflect::surfels
