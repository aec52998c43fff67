#include "render/lightfield/slf/reference.h"

#include "bench/slf/synthetic_field.h"
#include "srf/image/half_float.h"
#include "tests/render/lightfield/slf/cameras.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <tuple>
#include <vector>

namespace surflect::slf {
namespace {

using namespace bench;

// Texels of a function of (i, j), in all channels but for a factor.
std::vector<Texel> texelsOf(int width, int height, const auto& value) {
  std::vector<Texel> texels;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const auto v = static_cast<float>(value(i, j));
      texels.push_back({image::nearestHalf(v), image::nearestHalf(2 * v), image::nearestHalf(4 * v), 0});
    }
  return texels;
}

TEST(TexelAt, ReproducesBilinearFunctionsBetweenCentres) {
  const auto value = [](double x, double y) { return 1 + 2 * x - 3 * y + 0.5 * x * y; };
  const std::vector<Texel> texels = texelsOf(6, 4, value);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(0.5, 5.5), v(0.5, 3.5);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec2<double> place(u(random), v(random));
    EXPECT_NEAR(texelAt(texels, 6, 4, place)[0], value(place.x() - 0.5, place.y() - 0.5), 1e-12);
    EXPECT_NEAR(texelAt(texels, 6, 4, place)[2], 4 * value(place.x() - 0.5, place.y() - 0.5), 1e-12);
  }
}

TEST(TexelAt, IsConstantBeyondTheOutermostCentres) {
  const std::vector<Texel> texels = texelsOf(3, 2, [](int i, int j) { return i + 10 * j; });
  EXPECT_EQ(texelAt(texels, 3, 2, {0, 0})[0], 0);
  EXPECT_EQ(texelAt(texels, 3, 2, {3, 0.5})[0], 2);
  EXPECT_EQ(texelAt(texels, 3, 2, {-5, 9})[0], 10);
  const std::vector<Texel> single = texelsOf(1, 1, [](int, int) { return 7; });
  EXPECT_EQ(texelAt(single, 1, 1, {0.3, 0.9})[0], 7);
}

TEST(SlfReference, ConstantTexturesGiveAConstantPicture) {
  const Field field = syntheticField();
  const ConstantTextures textures(field, {0.25f, 0.5f, 2, 0.75f});
  const Reference reference(field, textures);
  std::mt19937 random(2);
  const auto picture = reference.render(randomCamera(random, 60, 50));
  size_t covered = 0;
  for (size_t i = 0; i < picture.observed.values.size(); ++i) {
    const bool isObject = picture.color.values[4 * i + 3] == 1;
    covered += isObject;
    const std::array<float, 4> expected =
        isObject ? std::array{0.25f, 0.5f, 2.f, 0.75f} : std::array{0.f, 0.f, 0.f, 0.f};
    for (size_t channel = 0; channel < 3; ++channel)
      ASSERT_NEAR(picture.color.values[4 * i + channel], expected[channel], 1e-6);
    ASSERT_NEAR(picture.observed.values[i], expected[3], 1e-6);
  }
  EXPECT_GT(covered, 500u);
}

// A texture of each direction whose value is the hat function there: F_i = 1, all others 0.
class OneDirection : public Textures {
public:
  OneDirection(const Field& field, size_t direction) : field_(field), direction_(direction) {}
  std::vector<Texel> read(size_t region, size_t direction) const override {
    const uint16_t value = image::nearestHalf(direction == direction_ ? 1.f : 0.f);
    return std::vector<Texel>(field_.regions[region].chart.texels(), Texel{value, value, value, value});
  }

private:
  const Field& field_;
  size_t direction_;
};

TEST(SlfReference, ATextureIsSeenByItsHatFunction) {
  const Field field = syntheticField();
  const DirectionMesh& mesh = field.directionMeshes[0];
  const Camera camera = cameraAt({0, 0, 4}, {0, 0, -1}, 40, 40, 60);
  size_t seen = 0;
  for (size_t direction = 0; direction < mesh.directions().size(); ++direction) {
    const OneDirection textures(field, direction);
    const auto picture = Reference(field, textures).render(camera);
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 40; ++x) {
        if (picture.color.at(x, y)[3] == 0) continue;
        // Directions to the camera do not depend on the surface.
        const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        const HatWeights hats = mesh.weightsAt(-normalized(camera.cameraFromWorld.inverse()(ray->direction)));
        double expected = 0;
        for (size_t i = 0; i < 3; ++i)
          if (hats.directions[i] == direction) expected = hats.weights[i];
        ASSERT_NEAR(picture.color.at(x, y)[0], expected, 1e-6);
        seen += expected > 0;
      }
  }
  EXPECT_GT(seen, 1000u);
}

TEST(SlfReference, BacksAreNotSeen) {
  const Field field = syntheticField({.bump = 0});
  const ConstantTextures textures(field, {1, 1, 1, 1});
  const Reference reference(field, textures);
  const auto inside = reference.render(cameraAt({0.2, 0, 0}, {0, 0, 1}, 20, 20, 10));
  for (const float value : inside.color.values) ASSERT_EQ(value, 0);
  // Without the front half, fronts behind the backs would be seen; a sphere has none.
  const auto hit = reference.firstHit({0, 0, 5}, {0, 0, -1});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->distance, 4, 1e-6);
}

TEST(SlfReference, PlacesAreContinuousWithinARegionWhateverCornerATriangleStartsAt) {
  Field field = syntheticField();
  const ConstantTextures textures(field, {1, 1, 1, 1});
  const Point3<AcquisitionSpace, double> eye(2, 1.5, 3);
  const auto towards = normalized(Point3<AcquisitionSpace, double>(0.1, 0.2, 0.1) - eye);
  const auto before = Reference(field, textures).firstHit(eye, towards);
  for (auto& [a, b, c] : field.mesh.triangles) std::tie(a, b, c) = std::tuple(b, c, a);
  const auto after = Reference(field, textures).firstHit(eye, towards);
  ASSERT_TRUE(before && after);
  EXPECT_EQ(before->region, after->region);
  EXPECT_NEAR((before->place - after->place).norm(), 0, 1e-4);
}

TEST(SlfReference, SplitVerticesChangeNothing) {
  Field field = syntheticField();
  const SyntheticTextures textures(field, {});
  const Camera camera = cameraAt({1, 2, 4}, {-0.25, -0.5, -1}, 40, 40, 60);
  const auto before = Reference(field, textures).render(camera);
  // Each triangle gets vertices of its own; charts keep theirs.
  const TriangleMesh mesh = field.mesh;
  for (auto& triangle : field.mesh.triangles)
    for (uint32_t& corner : triangle) {
      field.mesh.positions.push_back(mesh.positions[corner]);
      corner = static_cast<uint32_t>(field.mesh.positions.size() - 1);
    }
  const auto after = Reference(field, textures).render(camera);
  EXPECT_EQ(after.color.values, before.color.values);
  EXPECT_GT(std::ranges::count(before.observed.values, 1.f), 100);
}

} // namespace
} // namespace surflect::slf
