#include "srf/proxy/relief/integrate.h"

#include "srf/proxy/relief/frontal_plane.h"

#include <Eigen/Sparse>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace surflect::relief {

namespace {

size_t at(const image::Mask& mask, int x, int y) {
  return static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x);
}

// Blobs with holes, thin necks and pieces that touch at corners only.
image::Mask randomMask(int width, int height, double share, uint32_t seed) {
  std::mt19937 random(seed);
  image::Mask mask(width, height);
  for (auto& inside : mask.inside) inside = std::uniform_real_distribution()(random) < share;
  return mask;
}

// Pieces by number, from 1 on; 0 off the mask.
std::vector<int> pieces(const Differences& d) {
  std::vector<int> piece(d.mask.inside.size(), 0);
  int count = 0;
  for (size_t seed = 0; seed < piece.size(); ++seed) {
    if (!d.mask.inside[seed] || piece[seed]) continue;
    piece[seed] = ++count;
    for (bool grows = true; grows;) {
      grows = false;
      const auto join = [&](size_t i, size_t j) {
        if ((piece[i] == count) == (piece[j] == count)) return;
        piece[i] = piece[j] = count;
        grows = true;
      };
      for (size_t i = 0; i < piece.size(); ++i) {
        if (d.rightWeight[i] > 0) join(i, i + 1);
        if (d.downWeight[i] > 0) join(i, i + static_cast<size_t>(d.mask.width));
      }
    }
  }
  return piece;
}

void takeMeans(const Differences& d, std::vector<double>& f) {
  const auto piece = pieces(d);
  std::vector<double> sums(f.size() + 1, 0), counts(f.size() + 1, 0);
  for (size_t i = 0; i < f.size(); ++i) {
    sums[static_cast<size_t>(piece[i])] += f[i];
    ++counts[static_cast<size_t>(piece[i])];
  }
  for (size_t i = 0; i < f.size(); ++i)
    f[i] = piece[i] ? f[i] - sums[static_cast<size_t>(piece[i])] / counts[static_cast<size_t>(piece[i])] : 0;
}

// The normal equations by a direct solver; a pull to 0 on the first pixel of every piece makes them definite.
std::vector<double> directPotential(const Differences& d) {
  const auto n = static_cast<Eigen::Index>(d.mask.inside.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  const auto add = [&](size_t from, size_t to, double weight, double difference) {
    const auto i = static_cast<int>(from), j = static_cast<int>(to);
    entries.emplace_back(i, i, weight);
    entries.emplace_back(j, j, weight);
    entries.emplace_back(i, j, -weight);
    entries.emplace_back(j, i, -weight);
    b[i] -= weight * difference;
    b[j] += weight * difference;
  };
  const auto piece = pieces(d);
  for (size_t i = 0; i < d.mask.inside.size(); ++i) {
    const bool isFirst =
        std::find(piece.begin(), piece.end(), piece[i]) - piece.begin() == static_cast<int>(i);
    if (isFirst || piece[i] == 0) entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1);
    if (d.rightWeight[i] > 0) add(i, i + 1, d.rightWeight[i], d.right[i]);
    if (d.downWeight[i] > 0) add(i, i + static_cast<size_t>(d.mask.width), d.downWeight[i], d.down[i]);
  }
  Eigen::SparseMatrix<double> a(n, n);
  a.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd f = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(a).solve(b);
  std::vector<double> values(f.begin(), f.end());
  takeMeans(d, values);
  return values;
}

TEST(Potential, IsThatOfADirectSolver) {
  for (const double share : {1.0, 0.9, 0.7, 0.5, 0.2}) {
    std::mt19937 random(7);
    Differences d(randomMask(37, 50, share, 11));
    for (size_t i = 0; i < d.right.size(); ++i) {
      d.right[i] = std::normal_distribution<double>()(random);
      d.down[i] = std::normal_distribution<double>()(random);
      d.rightWeight[i] *= std::uniform_real_distribution(0.01, 1.0)(random);
      d.downWeight[i] *= std::uniform_real_distribution(0.01, 1.0)(random);
    }
    const auto f = potentialOf(d, {}), direct = directPotential(d);
    for (size_t i = 0; i < f.size(); ++i) EXPECT_NEAR(f[i], direct[i], 3e-6);
  }
}

TEST(Potential, DifferencesOfAFunctionGiveItBack) {
  for (const double share : {1.0, 0.8, 0.6}) {
    std::mt19937 random(3);
    Differences d(randomMask(83, 61, share, 5));
    std::vector<double> truth(d.mask.inside.size(), 0);
    for (double& value : truth) value = std::normal_distribution<double>()(random);
    for (size_t i = 0; i < truth.size(); ++i) {
      if (d.rightWeight[i] > 0) d.right[i] = truth[i + 1] - truth[i];
      if (d.downWeight[i] > 0) d.down[i] = truth[i + 83] - truth[i];
    }
    takeMeans(d, truth);
    const auto f = potentialOf(d, {});
    for (size_t i = 0; i < f.size(); ++i) EXPECT_NEAR(f[i], truth[i], 1e-6);
  }
}

TEST(Potential, PiecesDoNotKnowOfEachOther) {
  Differences d(randomMask(40, 30, 1, 1));
  for (double& value : d.right) value = 1;
  for (int y = 0; y < 30; ++y) d.rightWeight[at(d.mask, 19, y)] = 0; // cut, without a gap
  const auto f = potentialOf(d, {});
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) EXPECT_NEAR(f[at(d.mask, x, y)], x % 20 - 9.5, 1e-6);
}

TEST(Potential, NoPixelsNoAnswer) {
  EXPECT_TRUE(potentialOf(Differences(image::Mask(0, 0)), {}).empty());
  const auto nothing = potentialOf(Differences(image::Mask(5, 4)), {});
  EXPECT_EQ(nothing, std::vector<double>(20, 0));
}

TEST(Potential, Cancels) {
  Differences d(randomMask(16, 16, 1, 1));
  d.right[3] = 1;
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(potentialOf(d, progress), Cancelled);
}

} // namespace

namespace {

using DepthFunction = std::function<double(const Vec2<double>&)>; // of the image point

capture::Camera<AcquisitionSpace> cameraOf(capture::Lens::Model model, int size, double distortion = 0) {
  capture::Camera<AcquisitionSpace> camera;
  camera.lens = {model, size, size, 0.5 * size, 0.5 * size, 0.5 * size, 0.5 * size, 0, 0, 0, 0};
  if (model == capture::Lens::Model::pinhole) camera.lens.focalX = camera.lens.focalY = 1.6 * size;
  camera.lens.k1 = distortion;
  const Mat3<double> turn = Eigen::AngleAxisd(1.1, Vec3<double>(2, -1, 1).normalized()).toRotationMatrix();
  camera.cameraFromWorld = {turn, {0, 0, -3}};
  return camera;
}

// The normal of what is seen at a depth, by differences in space: no formula of the code under test.
Vec3<double> normalByDifferences(const capture::Lens& lens, const DepthFunction& depth,
                                 const Vec2<double>& q) {
  constexpr double h = 1e-5;
  const auto seen = [&](double x, double y) {
    const Vec2<double> p(q[0] + x, q[1] + y);
    return atDepth(lens, p, depth(p)).raw();
  };
  const Vec3<double> n = (seen(h, 0) - seen(-h, 0)).cross(seen(0, h) - seen(0, -h)).normalized();
  return n;
}

struct Scene {
  capture::Camera<AcquisitionSpace> camera;
  image::Image normals;
  image::Mask mask;
  std::vector<double> truth; // depth
};

Scene sceneOf(const capture::Camera<AcquisitionSpace>& camera, const DepthFunction& depth,
              const std::function<bool(const Vec2<double>&)>& isInside) {
  const int width = camera.lens.width, height = camera.lens.height;
  Scene scene{camera, image::Image(width, height, 3), image::Mask(width, height), {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Vec2<double> q = *imagePoint(camera.lens, {x + 0.5, y + 0.5});
      scene.truth.push_back(depth(q));
      scene.mask.inside[scene.truth.size() - 1] = isInside(q);
      if (!isInside(q)) continue;
      const Vec3<double> n =
          camera.cameraFromWorld.rotation().transpose() * normalByDifferences(camera.lens, depth, q);
      for (Eigen::Index c = 0; c < 3; ++c)
        scene.normals.at(x, y)[static_cast<size_t>(c)] = static_cast<float>(n[c]);
    }
  return scene;
}

bool wholePlane(const Vec2<double>&) { return true; }

// Root mean square error of depth where `counts`, after the free constant is taken: an offset of orthographic
// depths, a factor of pinhole ones.
double depthError(const Scene& scene, const DepthMap& map, const std::function<bool(size_t)>& counts) {
  const bool isPinhole = scene.camera.lens.model == capture::Lens::Model::pinhole;
  std::vector<double> errors;
  for (size_t i = 0; i < map.depth.size(); ++i)
    if (map.mask.inside[i] && counts(i))
      errors.push_back(isPinhole ? std::log(map.depth[i] / scene.truth[i]) : map.depth[i] - scene.truth[i]);
  double mean = 0, squares = 0;
  for (const double error : errors) mean += error / static_cast<double>(errors.size());
  for (const double error : errors) squares += (error - mean) * (error - mean);
  return std::sqrt(squares / static_cast<double>(errors.size()));
}

double depthError(const Scene& scene) {
  return depthError(scene, integrateNormals(scene.camera, scene.normals, scene.mask, {}),
                    [](size_t) { return true; });
}

double waves(const Vec2<double>& q) {
  return 3 + 0.2 * std::sin(2 * q[0] + 0.4) * std::cos(1.5 * q[1]) + 0.1 * q[0];
}

TEST(DepthGradient, IsThatOfTheSeenSurface) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> position(-0.4, 0.4);
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const capture::Lens lens = cameraOf(model, 32).lens;
    for (int i = 0; i < 200; ++i) {
      const Vec2<double> q(position(random), position(random));
      constexpr double h = 1e-5;
      const auto value = [&](double x, double y) {
        const double depth = waves(q + Vec2<double>(x, y));
        return model == capture::Lens::Model::pinhole ? std::log(depth) : depth;
      };
      const Vec2<double> truth(value(h, 0) - value(-h, 0), value(0, h) - value(0, -h));
      const Vec2<double> gradient = depthGradient(lens, q, 7 * normalByDifferences(lens, waves, q));
      EXPECT_LT((gradient - truth / (2 * h)).norm(), 1e-7);
    }
  }
}

TEST(DepthGradient, StaysFiniteAtAndBeyondTheOutline) {
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const capture::Lens lens = cameraOf(model, 32).lens;
    for (double angle = 0; angle < 3.1; angle += 0.01) {
      const Vec2<double> g = depthGradient(lens, {0, 0}, {std::sin(angle), 0, std::cos(angle)});
      EXPECT_LE(g.norm(), 10 + 1e-9) << angle;
      EXPECT_GE(g[0], 0) << angle;
    }
    EXPECT_EQ(depthGradient(lens, {0.1, 0.2}, Vec3<double>::Zero()), Vec2<double>(0, 0));
  }
}

// Normals come as floats: the errors stay well above what that costs.
TEST(Integrate, ErrorsFallWithTheSquareOfThePixel) {
  for (const auto& [model, distortion] : {std::pair{capture::Lens::Model::orthographic, 0.0},
                                          {capture::Lens::Model::pinhole, 0.0},
                                          {capture::Lens::Model::pinhole, -0.15}}) {
    std::vector<double> errors;
    for (const int size : {16, 32, 64})
      errors.push_back(depthError(sceneOf(cameraOf(model, size, distortion), waves, wholePlane)));
    EXPECT_GT(errors[0] / errors[1], 3.5);
    EXPECT_GT(errors[1] / errors[2], 3.5);
    EXPECT_LT(errors[2], 1e-4);
  }
}

TEST(Integrate, ASphereComesBack) {
  const auto sphere = [](const Vec2<double>& q) {
    return 3 - std::sqrt(std::max(0.0, 0.64 - q.squaredNorm()));
  };
  const auto cap = [](const Vec2<double>& q) { return q.norm() < 0.72; }; // down to 26 degrees above grazing
  const double coarse = depthError(sceneOf(cameraOf(capture::Lens::Model::orthographic, 40), sphere, cap));
  const double fine = depthError(sceneOf(cameraOf(capture::Lens::Model::orthographic, 160), sphere, cap));
  EXPECT_LT(coarse, 2e-3);
  EXPECT_LT(fine, 2e-4);
}

TEST(Integrate, EveryPieceLiesAroundTheFrontalPlane) {
  // A ring, a bar beside it and a lone pixel.
  const auto inRing = [](const Vec2<double>& q) { return q.norm() > 0.3 && q.norm() < 0.6; };
  const auto inBar = [](const Vec2<double>& q) { return q[0] > 0.8; };
  const auto isInside = [&](const Vec2<double>& q) {
    return inRing(q) || inBar(q) || (q - Vec2<double>(-0.81, -0.81)).norm() < 0.02;
  };
  const Scene scene = sceneOf(cameraOf(capture::Lens::Model::orthographic, 64), waves, isInside);
  const DepthMap map = integrateNormals(scene.camera, scene.normals, scene.mask, {});
  const auto imagePointOf = [&](size_t i) {
    return *imagePoint(scene.camera.lens,
                       {static_cast<double>(i % 64) + 0.5, static_cast<double>(i / 64) + 0.5});
  };
  for (const auto& piece : std::vector<std::function<bool(const Vec2<double>&)>>{
           inRing, inBar, [](const Vec2<double>& q) { return q[0] < -0.7; }}) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < map.depth.size(); ++i)
      if (map.mask.inside[i] && piece(imagePointOf(i))) sum += map.depth[i], ++count;
    ASSERT_GE(count, 1);
    EXPECT_NEAR(sum / count, frontalDepth(scene.camera), 1e-9);
    EXPECT_LT(depthError(scene, map, [&](size_t i) { return piece(imagePointOf(i)); }), 2e-4);
  }
}

TEST(Integrate, WhatIsUnknownFollowsItsNeighbours) {
  const auto slope = [](const Vec2<double>& q) { return 3 + 0.5 * q[0]; };
  Scene scene = sceneOf(cameraOf(capture::Lens::Model::orthographic, 48), slope, wholePlane);
  const auto inHole = [](size_t i) { return i % 48 >= 20 && i % 48 < 26 && i / 48 >= 20 && i / 48 < 26; };
  for (size_t i = 0; i < scene.mask.inside.size(); ++i)
    if (inHole(i)) std::fill_n(&scene.normals.values[3 * i], 3, 0.f);
  const DepthMap map = integrateNormals(scene.camera, scene.normals, scene.mask, {});
  EXPECT_LT(depthError(scene, map, [&](size_t i) { return !inHole(i); }), 1e-5);
  const double across = 0.5 * 6 * 2.0 / 48; // what depth changes over the hole
  for (size_t i = 0; i < scene.truth.size(); ++i)
    if (inHole(i)) {
      EXPECT_NEAR(map.depth[i] - frontalDepth(scene.camera), scene.truth[i] - 3, across / 2);
    }
}

TEST(FrontalPlane, HoldsTheOrigin) {
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const auto camera = cameraOf(model, 32, model == capture::Lens::Model::pinhole ? -0.1 : 0);
    const capture::Pixel pixel = *camera.project({0, 0, 0});
    const auto p = camera.cameraFromWorld.inverse()(
        atDepth(camera.lens, *imagePoint(camera.lens, pixel), frontalDepth(camera)));
    EXPECT_LT(p.raw().norm(), 1e-12);
  }
}

TEST(FrontalPlane, OfACameraAtTheOriginIsOneUnitAway) {
  capture::Camera<AcquisitionSpace> camera = cameraOf(capture::Lens::Model::pinhole, 32);
  for (const double z : {0.0, 2.0}) {
    camera.cameraFromWorld = {Mat3<double>::Identity(), {0, 0, z}};
    EXPECT_EQ(frontalDepth(camera), 1);
  }
}

TEST(FrontalPlane, DepthIsWhatProjectionUndoes) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> position(0, 32), depth(0.5, 5);
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const capture::Lens lens = cameraOf(model, 32, model == capture::Lens::Model::pinhole ? 0.05 : 0).lens;
    for (int i = 0; i < 100; ++i) {
      const capture::Pixel pixel{position(random), position(random)};
      const auto again = capture::project(lens, atDepth(lens, *imagePoint(lens, pixel), depth(random)));
      EXPECT_NEAR(again->x, pixel.x, 1e-10);
      EXPECT_NEAR(again->y, pixel.y, 1e-10);
    }
  }
}

} // namespace

} // namespace surflect::relief
