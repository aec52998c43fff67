#include "srf/planes/stack.h"

#include "srf/capture/writer.h"
#include "srf/image/png.h"
#include "srf/planes/basis.h"
#include "srf/planes/left_out.h"
#include "srf/planes/normals.h"
#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::planes {
namespace {

constexpr int kSide = 40;

// Unit normal of a ball that fills the picture; zero off the ball.
Vec3<double> normalAt(int x, int y) {
  const double u = (x + 0.5) / kSide * 2 - 1, v = 1 - (y + 0.5) / kSide * 2, rest = 1 - u * u - v * v;
  return rest > 0 ? Vec3<double>(u, v, std::sqrt(rest)) : Vec3<double>::Zero();
}

// A Lambert ball under lights of different strengths, as 16-bit PNG; `views` cameras at one place.
class LambertBall {
public:
  explicit LambertBall(size_t lights, size_t views = 1) {
    std::mt19937 random(3);
    capture::Capture capture;
    capture.colorSpace = capture::ColorSpace::linear;
    for (size_t v = 0; v < views; ++v) {
      capture::Camera<AcquisitionSpace> camera;
      camera.lens = {.model = capture::Lens::Model::orthographic,
                     .width = kSide,
                     .height = kSide,
                     .focalX = kSide / 2.0,
                     .focalY = kSide / 2.0,
                     .centerX = kSide / 2.0,
                     .centerY = kSide / 2.0};
      camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(0, 0, -3)};
      capture.views.push_back({"C" + std::to_string(v), camera});
    }
    while (capture.lights.size() < lights) {
      const Vec3<double> towards = randomUnit(random);
      if (towards.z() < 0.4 && capture.lights.size() + 1 < lights) continue; // the last one may be anywhere
      const std::string name = "L" + std::to_string(capture.lights.size());
      const float strength = 0.5f + 0.1f * static_cast<float>(capture.lights.size() % 5);
      capture.lights.push_back(
          {name, name,
           capture::DirectionalLight{
               assume<Direction3<AcquisitionSpace, double>>(
                   capture.lights.size() + 1 < lights ? towards : Vec3<double>(0, 0.6, -0.8)),
               {strength, strength, strength}}});
    }
    for (size_t v = 0; v < views; ++v)
      for (size_t l = 0; l < lights; ++l) {
        const auto& light = std::get<capture::DirectionalLight>(capture.lights[l].kind);
        image::Image picture(kSide, kSide, 3);
        for (int y = 0; y < kSide; ++y)
          for (int x = 0; x < kSide; ++x) {
            const auto shade = static_cast<float>(std::max(0.0, normalAt(x, y).dot(light.towards.raw())));
            const float pixel[] = {0.9f * shade * light.irradiance.r, 0.6f * shade * light.irradiance.g,
                                   0.3f * shade * light.irradiance.b};
            std::copy(pixel, pixel + 3, picture.at(x, y).begin());
          }
        const std::string name = std::to_string(v) + "_" + std::to_string(l) + ".png";
        image::writePng(folder_.path() / name, picture, 16);
        capture.frames.push_back({.view = v, .light = l, .picture = name});
      }
    capture::writeCapture(capture, folder_.path());
  }

  capture::Capture read() const { return capture::readCapture(folder_.path()); }

private:
  image::TemporaryFolder folder_;
};

TEST(Stack, LightsBehindThePictureAreLeftOutAndStrengthsDividedOut) {
  const LambertBall ball(12);
  const Stack stack = stackOf(ball.read());
  ASSERT_EQ(stack.size(), 11u); // the twelfth is behind
  ASSERT_EQ(stack.notes.size(), 1u);
  const image::Image photograph = readPhotograph(stack, 3);
  for (int x = 5; x < kSide; x += 7) {
    const double shade = std::max(0.0, normalAt(x, 20).dot(stack.towardsLights[3]));
    EXPECT_NEAR(photograph.at(x, 20)[0], 0.9 * shade, 5e-5);
  }
}

TEST(Stack, SeveralViewsAndTooFewLightsAreRefused) {
  const LambertBall two(5, 2), few(3);
  EXPECT_THROW(stackOf(two.read()), Error);
  EXPECT_THROW(stackOf(few.read()), Error); // of three, one is behind
}

// Few samples are spread over the picture, each pixel at most once where there are fewer samples than half
// the pixels.
TEST(Stack, SamplesAreSpreadOverThePicture) {
  const LambertBall ball(5);
  const Samples samples = sample(stackOf(ball.read()), 100, {});
  ASSERT_EQ(samples.pixels.size(), 100u);
  for (size_t i = 1; i < 100; ++i) {
    EXPECT_GT(samples.pixels[i], samples.pixels[i - 1]);
    EXPECT_LT(samples.pixels[i] - samples.pixels[i - 1], 32u); // 16 on average
  }
}

TEST(Planes, AllPlanesGiveThePhotographsBack) {
  const LambertBall ball(8);
  const Stack stack = stackOf(ball.read());
  const Samples samples = sample(stack, stack.pixels(), {});
  const Basis basis = principalBasis(momentsOf(encodedSamples(samples, 1)), 21);
  const Planes planes = projected(stack, basis, 1, {});
  for (size_t i = 0; i < planes.pixels(); i += 37) {
    Eigen::VectorXf coefficients(basis.planes());
    for (Eigen::Index k = 0; k < basis.planes(); ++k)
      coefficients[k] = planes.values[static_cast<size_t>(k)][i];
    const Eigen::VectorXf shown = basis.mean + basis.vectors * coefficients;
    for (Eigen::Index row = 0; row < shown.size(); ++row)
      EXPECT_NEAR(decoded(shown[row]), samples.linear(row, static_cast<Eigen::Index>(i)), 3e-6f);
  }
}

TEST(Planes, NormalsOfALambertBallAreItsOwn) {
  const LambertBall ball(12);
  const Stack stack = stackOf(ball.read());
  const Basis basis = principalBasis(momentsOf(encodedSamples(sample(stack, stack.pixels(), {}), 1)), 33);
  const Planes normals = normalsOf(projected(stack, basis, 1, {}), basis, stack.towardsLights, {});
  for (int y = 10; y < 30; ++y)
    for (int x = 10; x < 30; ++x) {
      const auto i = static_cast<size_t>(y * kSide + x);
      EXPECT_NEAR(normals.values[0][i], normalAt(x, y).x(), 2e-3);
      EXPECT_NEAR(normals.values[1][i], normalAt(x, y).y(), 2e-3);
    }
}

TEST(LeftOut, ALightThatWasPhotographedTwiceIsPredictedByItsTwin) {
  const LambertBall ball(9);
  Stack stack = stackOf(ball.read());
  stack.capture.frames.push_back(stack.capture.frames.front());
  stack.towardsLights.push_back(stack.towardsLights.front());
  stack.irradiance.push_back(stack.irradiance.front());
  stack.lights.push_back("twin");
  const Samples samples = sample(stack, stack.pixels(), {});
  const std::vector<LeftOutLight> lights = leaveLightsOut(stack, samples, 1, 30, 9, {});
  EXPECT_EQ(lights.front().photograph, 0u);
  EXPECT_GT(lights.front().errors.srgbDb(), 90);
  EXPECT_LT(lights[4].errors.srgbDb(), 60);
}

} // namespace
} // namespace surflect::planes
