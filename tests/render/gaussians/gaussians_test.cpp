#include "render/gaussians/gaussians.h"

#include "render/gaussians/gaussian_ply.h"
#include "render/gaussians/particle_field.h"
#include "srf/image/color.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/geometry/ply.h"
#include "surfel/math/sphere_sampling.h"
#include "tests/render/films.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

namespace surflect::gaussians {
namespace {

Mat3<double> rotationOf(const Shape& shape) {
  return Eigen::Quaterniond(shape.rotation[0], shape.rotation[1], shape.rotation[2], shape.rotation[3])
      .toRotationMatrix();
}

// R diag(scale)^2 R^T
Mat3<double> covarianceOf(const Shape& shape) {
  const Vec3<double> scale(shape.scale[0], shape.scale[1], shape.scale[2]);
  const Mat3<double> axes = rotationOf(shape) * scale.asDiagonal();
  return axes * axes.transpose();
}

Shape shapeOf(const Vec3<double>& u, const Vec3<double>& v, Handedness handedness, float radius) {
  return gaussians::shapeOf({1, 2, 3}, assume<Direction3<ObjectSpace>>(u), assume<Direction3<ObjectSpace>>(v),
                            handedness, radius);
}

// The covariance of the points a u + b v is s^2 (u u^T + v v^T), whatever axes it is written in; beside it is
// the thickness alone.
TEST(GaussianShape, HasTheCovarianceOfTheShearedEllipse) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3<double> u = randomUnit(random), v = 3 * randomUnit(random);
    const float radius = 0.25f;
    const Shape shape = shapeOf(u, v, Handedness::kept, radius);
    const Vec3<double> normal = u.cross(v).normalized();
    const double deviation = kDeviationPerRadius * radius;
    const Mat3<double> flat = deviation * deviation * (u * u.transpose() + v * v.transpose());
    const Mat3<double> thick = std::pow(kThickness * shape.scale[1], 2) * (normal * normal.transpose());
    EXPECT_LT((covarianceOf(shape) - flat - thick).norm(), 4e-7 * flat.norm());
    EXPECT_GT(shape.normal.cast<double>().dot(normal), 1 - 1e-6);
    EXPECT_GE(shape.rotation[0], 0);
    EXPECT_GE(shape.scale[0], shape.scale[1]);
  }
}

TEST(GaussianShape, OfAMirroredSurfelPointsOutwards) {
  const Vec3<double> u(1, 0, 0), v(0, 2, 0);
  EXPECT_GT(shapeOf(u, v, Handedness::kept, 1).normal[2], 0.999f);
  const Shape mirrored = shapeOf(u, v, Handedness::mirrored, 1);
  EXPECT_LT(mirrored.normal[2], -0.999f);
  EXPECT_GT((rotationOf(mirrored) * Vec3<double>::UnitZ()).dot(mirrored.normal.cast<double>()), 0.999);
}

// The long axis may come out along either side, and a circle's axes anywhere; neighbours in time must agree.
TEST(GaussianShape, AxesNearestToThoseBeforeKeepTheEllipsoidAndTurnLittle) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0, 1);
  const auto dot = [](const Shape& a, const Shape& b) {
    double sum = 0;
    for (size_t k = 0; k < 4; ++k) sum += double{a.rotation[k]} * double{b.rotation[k]};
    return sum;
  };
  double least = 1;
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3<double> u = randomUnit(random), v = (1 + any(random)) * u.unitOrthogonal();
    const Mat3<double> turn = Eigen::AngleAxisd(0.2 * any(random), randomUnit(random)).toRotationMatrix();
    const Shape before = shapeOf(u, v, Handedness::kept, 1);
    // The ellipse turns a bit, and what was its longer axis becomes the shorter one in half of the trials.
    const double stretch = trial % 2 ? 1 : 3;
    const Shape after = shapeOf(turn * (stretch * u), turn * v, Handedness::kept, 1);
    const Shape nearest = nearestTo(before, after);
    EXPECT_LT((covarianceOf(nearest) - covarianceOf(after)).norm(), 1e-6 * covarianceOf(after).norm());
    EXPECT_EQ(nearest.normal, after.normal);
    least = std::min(least, dot(before, nearest));
  }
  EXPECT_GT(least, std::cos(0.1) - 1e-5); // half of the turn
}

TEST(GaussianPly, FieldsGiveBackScaleOpacityAndColour) {
  Shape shape;
  shape.center = {1, 2, 3};
  shape.scale = {0.5f, 0.25f, 0.01f};
  Look look;
  look.color[0] = {0.25 / kConstantHarmonic, 0.5 / kConstantHarmonic, 1 / kConstantHarmonic};
  for (size_t j = 1; j < kMostCoefficients; ++j) look.color[j] = {1.0 * j, 100.0 + j, 200.0 + j};
  look.opacity = 0.75f;
  for (int degree = 0; degree <= kHighestDegree; ++degree) {
    const std::vector<std::string> fields = plyFields(degree);
    const std::vector<float> values = plyValues(shape, look, degree);
    ASSERT_EQ(values.size(), fields.size());
    const auto at = [&](const std::string& field) {
      return double{values[static_cast<size_t>(std::ranges::find(fields, field) - fields.begin())]};
    };
    EXPECT_EQ(at("z"), 3);
    EXPECT_NEAR(0.5 + kConstantHarmonic * at("f_dc_0"), 0.25, 1e-7);
    EXPECT_EQ(at("f_dc_1"), 0);
    EXPECT_NEAR(0.5 + kConstantHarmonic * at("f_dc_2"), 1, 1e-7);
    EXPECT_NEAR(1 / (1 + std::exp(-at("opacity"))), 0.75, 1e-7);
    EXPECT_NEAR(std::exp(at("scale_1")), 0.25, 1e-7);
    EXPECT_EQ(at("rot_0"), 1);
    if (degree == 0) continue;
    const size_t perChannel = coefficientsOf(degree) - 1; // all of red come first
    EXPECT_EQ(at("f_rest_0"), 1);
    EXPECT_EQ(at("f_rest_" + std::to_string(perChannel)), 101);
    EXPECT_EQ(at("f_rest_" + std::to_string(3 * perChannel - 1)), 200.0 + static_cast<double>(perChannel));
  }
}

TEST(GaussianPly, ValuesAreFiniteForNoOpacityAndNoWidth) {
  Look look;
  look.opacity = 0;
  for (const float value : plyValues({}, look, 3)) EXPECT_TRUE(std::isfinite(value));
  look.opacity = 1;
  for (const float value : plyValues({}, look, 3)) EXPECT_TRUE(std::isfinite(value));
}

class GaussiansOfSphere : public studio::PackedSphere<1500> {
protected:
  surfels::OutgoingRadiance radianceUnder(const warp::Warp& warp,
                                          const std::vector<scene::ShotLight>& lights) {
    return {model(), drawn, {warp, camera, lights}, options, workspace};
  }

  const std::vector<scene::ShotLight> lamp{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
  const surfels::FrameOptions options;
  const surfels::DrawnSurfels drawn = surfels::drawnSurfels(model(), model().cloud.size());
  surfels::FrameWorkspace workspace{model(), size_t{1} << 26};
};

// A Lambert sphere looks the same from everywhere: its harmonics are the sRGB curve of A / pi E, but for what
// its photographs and the blend of lights leave.
TEST_F(GaussiansOfSphere, ALambertSphereHasTheColourOfItsClosedForm) {
  const auto still = studio::noWarp();
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp);
  const Gaussians gaussians(radiance, 0.5);
  ASSERT_EQ(gaussians.size(), model().cloud.size());
  const std::vector<Look> looks = gaussians.looks(0, gaussians.size(), 3);
  double squared = 0, largestRest = 0;
  size_t lit = 0;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    const Vec3<double> n = gaussians.shape(i).center.cast<double>();
    const Vec3<double> toLight = Vec3<double>(2, 1, 2) - n;
    const double cosine = n.dot(toLight.normalized());
    if (cosine < 0.3) continue;
    ++lit;
    const double red = studio::Studio{}.albedo.r / std::numbers::pi * 9 * cosine / toLight.squaredNorm();
    const double error =
        kConstantHarmonic * looks[i].color[0][0] - double{image::srgbFromLinear(static_cast<float>(red / 2))};
    squared += error * error;
    for (size_t j = 1; j < kMostCoefficients; ++j)
      largestRest = std::max(largestRest, std::abs(looks[i].color[j][0]));
    EXPECT_EQ(looks[i].opacity, static_cast<float>(kOpacity));
  }
  EXPECT_GT(lit, 300u);
  EXPECT_LT(std::sqrt(squared / static_cast<double>(lit)), 0.006);
  EXPECT_LT(largestRest, 0.06);
}

TEST_F(GaussiansOfSphere, HaveTheSameLooksInPartsAndAtOnce) {
  const auto twist = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(50), {0, 0, 0});
  const surfels::OutgoingRadiance radiance = radianceUnder(*twist, lamp);
  const Gaussians gaussians(radiance, 1);
  const std::vector<Look> whole = gaussians.looks(0, 200, 1), part = gaussians.looks(150, 200, 1);
  for (size_t i = 0; i < part.size(); ++i) {
    EXPECT_EQ(part[i].color, whole[150 + i].color);
    EXPECT_EQ(part[i].opacity, whole[150 + i].opacity);
  }
}

TEST_F(GaussiansOfSphere, AFileHasTheBytesThatWereStatedAndOurReaderFindsItsValues) {
  const auto still = studio::noWarp();
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp);
  const Gaussians gaussians(radiance, 1);
  const auto path = std::filesystem::path(::testing::TempDir()) / "gaussians.ply";
  writeGaussianPly(path, gaussians, 2, "a comment");
  EXPECT_EQ(std::filesystem::file_size(path), plyBytes(gaussians.size(), 2, "a comment"));
  const PlyFile file = readPly(path);
  const PlyElement* vertices = file.find("vertex");
  ASSERT_TRUE(vertices);
  ASSERT_EQ(vertices->count, gaussians.size());
  const std::vector<Look> looks = gaussians.looks(0, gaussians.size(), 2);
  const std::vector<std::string> fields = plyFields(2);
  for (const size_t i : {size_t{0}, gaussians.size() - 1}) {
    const std::vector<float> values = plyValues(gaussians.shape(i), looks[i], 2);
    for (size_t field = 0; field < fields.size(); ++field)
      EXPECT_EQ(vertices->scalars(fields[field])[i], values[field]) << fields[field];
  }
}

TEST_F(GaussiansOfSphere, ExposureMultipliesRadiance) {
  const auto still = studio::noWarp();
  const std::vector<scene::ShotLight> brighter{scene::ShotPointLight{{2, 1, 2}, {18, 16, 14}}};
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp),
                                  twice = radianceUnder(*still, brighter);
  const std::vector<Look> exposed = Gaussians(radiance, 0.5).looks(0, 300, 1),
                          lit = Gaussians(twice, 0.25).looks(0, 300, 1);
  double largest = 0;
  for (size_t i = 0; i < exposed.size(); ++i)
    for (size_t j = 0; j < 4; ++j)
      for (size_t channel = 0; channel < 3; ++channel)
        largest = std::max(largest, std::abs(exposed[i].color[j][channel] - lit[i].color[j][channel]));
  EXPECT_LT(largest, 1e-5);
}

// Numbers of an attribute of a .usda file, by time; time -1 for one that is not sampled.
std::map<int, std::vector<double>> numbersOf(const std::string& text, const std::string& attribute) {
  std::map<int, std::vector<double>> numbers;
  const size_t begin = text.find(attribute);
  EXPECT_NE(begin, text.npos) << attribute;
  std::istringstream lines(text.substr(text.find('=', begin) + 1));
  std::string line;
  const auto read = [&](int time, std::string values) {
    for (char& c : values)
      if (std::string_view("[](),").find(c) != std::string_view::npos) c = ' ';
    std::istringstream stream(values);
    for (double value; stream >> value;) numbers[time].push_back(value);
  };
  std::getline(lines, line);
  if (line.find('{') == line.npos) {
    read(-1, line);
    return numbers;
  }
  while (std::getline(lines, line) && line.find('}') == line.npos)
    read(std::stoi(line), line.substr(line.find(':') + 1));
  return numbers;
}

class ParticleField : public GaussiansOfSphere {
protected:
  // The file of a warp at each frame.
  std::string written(const std::vector<warp::WarpPointer>& warps) {
    std::vector<int> frames;
    for (size_t k = 0; k < warps.size(); ++k) frames.push_back(static_cast<int>(k));
    const ParticleFieldFrames field{frames, 24, drawn.cloud.size(), false, "a comment"};
    const GaussiansAt at = [&](size_t k) {
      const auto* radiance =
          radiances.emplace_back(new surfels::OutgoingRadiance(radianceUnder(*warps[k], lamp))).get();
      return std::make_shared<const Gaussians>(*radiance, 1);
    };
    writeParticleField(path, field, at, 0);
    return readFile(path);
  }

  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "field.usda";
  std::vector<std::unique_ptr<const surfels::OutgoingRadiance>> radiances;
};

// A surfel that begins without area grows.
TEST_F(ParticleField, OpacityIsThatOfTheFirstFrameInWhichASurfelLives) {
  std::vector<warp::WarpPointer> warps;
  warps.push_back(warp::scaleWarp({0, 0, 0}, {0, 0, 0}));
  warps.push_back(studio::noWarp());
  const std::string text = written(warps);
  const auto opacities = numbersOf(text, "float[] opacities");
  ASSERT_EQ(opacities.at(-1).size(), drawn.cloud.size());
  for (const double opacity : opacities.at(-1)) EXPECT_NEAR(opacity, kOpacity, 1e-4);
  const auto scales = numbersOf(text, "float3[] scales");
  for (const double scale : scales.at(0)) EXPECT_EQ(scale, 0);
  EXPECT_GT(*std::ranges::min_element(scales.at(1)), 0);
}

TEST_F(ParticleField, WithoutALivingSurfelIsAnError) {
  std::vector<warp::WarpPointer> warps;
  for (int k = 0; k < 2; ++k) warps.push_back(warp::scaleWarp({0, 0, 0}, {0, 0, 0}));
  std::filesystem::remove(path);
  EXPECT_THROW(written(warps), Error);
  EXPECT_FALSE(std::filesystem::exists(path));
}

// Programs interpolate quaternions and scales between samples. Under a slow twist no axis may jump.
TEST_F(ParticleField, AxesTurnSlowlyUnderASlowTwist) {
  std::vector<warp::WarpPointer> warps;
  constexpr double kDegrees = 6; // a frame
  for (int k = 0; k < 8; ++k)
    warps.push_back(warp::twistWarp({0, 1, 0}, Angle::fromDegrees(kDegrees * k), {0, 0, 0}));
  const std::string text = written(warps);
  const auto turns = numbersOf(text, "quatf[] orientations");
  const auto scales = numbersOf(text, "float3[] scales");
  double mostDegrees = 0;
  size_t count = 0;
  for (int k = 1; k < 8; ++k)
    for (size_t i = 0; i < drawn.cloud.size(); ++i) {
      const auto isRound = [&](int frame) {
        return std::abs(std::log(scales.at(frame)[3 * i] / scales.at(frame)[3 * i + 1])) < 0.1;
      };
      if (isRound(k) || isRound(k - 1)) continue; // its axes may turn freely
      ++count;
      double dot = 0;
      for (size_t c = 0; c < 4; ++c) dot += turns.at(k)[4 * i + c] * turns.at(k - 1)[4 * i + c];
      mostDegrees = std::max(mostDegrees, 2 * std::acos(std::min(1.0, dot)) * 180 / std::numbers::pi);
    }
  RecordProperty("most_degrees", std::to_string(mostDegrees));
  EXPECT_GT(count, 1000u);
  EXPECT_LT(mostDegrees, 10.5); // measured: 5.3
}

// A glossy sphere, whose fits are compared with those of many more directions as a viewer sees them: blends
// of neighbours, in which highlights must neither vanish nor spread.
TEST(GaussiansOfGlossySphere, KeepHighlightsWhereverTheyFallBetweenDirections) {
  const studio::PackedStudio packed(studio::Studio{.cameras = 40, .size = 40, .gloss = 1}, 1500);
  const surfels::FrameOptions options;
  const surfels::DrawnSurfels drawn = surfels::drawnSurfels(packed.model, packed.model.cloud.size());
  surfels::FrameWorkspace workspace(packed.model, size_t{1} << 26);
  const auto still = studio::noWarp();
  const std::vector<scene::ShotLight> lamp{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
  const surfels::OutgoingRadiance radiance(packed.model, drawn, {*still, {}, lamp}, options, workspace);
  const Gaussians gaussians(radiance, 0.3);
  const std::vector<Vec3<double>> dense = fibonacciSphere(1024);
  std::vector<std::array<double, kMostCoefficients>> harmonics;
  for (const Vec3<double>& d : dense) harmonics.push_back(harmonicsAt(-d));
  std::vector<std::vector<Color>> colors(gaussians.size(), std::vector<Color>(dense.size()));
  std::vector<std::vector<double>> weights(gaussians.size(), std::vector<double>(dense.size()));
  for (size_t k = 0; k < dense.size(); ++k) {
    std::vector<uint32_t> facing, places;
    for (size_t i = 0; i < gaussians.size(); ++i)
      if (const double cosine = gaussians.shape(i).normal.cast<double>().dot(dense[k]); cosine >= 0.1) {
        facing.push_back(gaussians.alive()[i]);
        places.push_back(static_cast<uint32_t>(i));
        weights[i][k] = cosine;
      }
    const shading::Shaded shaded =
        radiance.towards(assume<Direction3<ObjectSpace, double>>(dense[k]), facing);
    for (size_t f = 0; f < facing.size(); ++f) {
      const auto shown = [&](float value) {
        return double{image::srgbFromLinear(std::clamp(0.3f * value, 0.f, 1.f))};
      };
      const Rgb& rgb = shaded.radiance[f];
      colors[places[f]][k] = {shown(rgb.r), shown(rgb.g), shown(rgb.b)};
    }
  }
  for (int degree = 0; degree <= kHighestDegree; ++degree) {
    const std::vector<Look> looks = gaussians.looks(0, gaussians.size(), degree);
    const std::vector<Vec3<double>> viewers = fibonacciSphere(50);
    double squared = 0;
    size_t count = 0;
    std::vector<Coefficients> truth;
    for (size_t i = 0; i < gaussians.size(); ++i)
      truth.push_back(fitted(harmonics, colors[i], weights[i], degree));
    for (const Vec3<double>& viewer : viewers) {
      const auto y = harmonicsAt(-viewer);
      std::vector<double> errors(gaussians.size());
      for (size_t i = 0; i < gaussians.size(); ++i)
        for (size_t j = 0; j < kMostCoefficients; ++j)
          errors[i] += y[j] * (looks[i].color[j][0] - truth[i][j][0]);
      for (size_t i = 0; i < gaussians.size(); i += 10) {
        const Vec3<double> n = gaussians.shape(i).normal.cast<double>();
        if (n.dot(viewer) < 0.5) continue;
        double sum = 0, near = 0;
        for (size_t other = 0; other < gaussians.size(); ++other)
          if (gaussians.shape(other).normal.cast<double>().dot(n) > 0.99) sum += errors[other], ++near;
        squared += (sum / near) * (sum / near);
        ++count;
      }
    }
    const double blotches = std::sqrt(squared / static_cast<double>(count));
    EXPECT_LT(blotches, 0.0022) << degree; // measured: 0.0011, of degree 3
  }
}

TEST_F(GaussiansOfSphere, AnInterruptionLeavesNoFile) {
  const auto still = studio::noWarp();
  const surfels::OutgoingRadiance radiance = radianceUnder(*still, lamp);
  const Gaussians gaussians(radiance, 1);
  const auto path = std::filesystem::path(::testing::TempDir()) / "interrupted.ply";
  int asked = 0;
  Progress progress;
  progress.cancelled = [&] { return ++asked > 20; };
  EXPECT_THROW(writeGaussianPly(path, gaussians, 3, "", progress), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(path));
}

} // namespace
} // namespace surflect::gaussians
