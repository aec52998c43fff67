#include "bench/plain_splats/doll_cloud.h"

#include "surfel/sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace surflect::bench {

namespace {

using V3 = Vec3<double>;

struct Ball {
  V3 center;
  double radius;
};

// It sits with its arms and legs spread towards the viewer.
std::vector<Ball> dollBalls() {
  std::vector<Ball> balls{{{0, -0.15, 0}, 0.72}, {{0, 0.72, 0.1}, 0.48}, {{0, 0.35, 0.05}, 0.45}};
  const auto limb = [&](V3 from, V3 to, double thick, double thin) {
    for (int i = 0; i <= 8; ++i) {
      const double s = i / 8.0;
      balls.push_back({(1 - s) * from + s * to, (1 - s) * thick + s * thin});
    }
  };
  for (const double side : {-1.0, 1.0}) {
    limb({0.5 * side, 0.35, 0.1}, {1.35 * side, 0.5, 0.35}, 0.2, 0.15);
    limb({0.4 * side, -0.6, 0.1}, {1.2 * side, -0.85, 0.7}, 0.3, 0.2);
    limb({0.45 * side, 0.1, 0.5}, {0.1 * side, -0.2, 0.95}, 0.12,
         0.1); // a toy in front of it, seen before it
  }
  return balls;
}

// Points of the union's surface, about `density` to the unit of area.
void sample(const std::vector<Ball>& balls, double density, std::mt19937& random, SurfelCloud& cloud) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::uniform_real_distribution<double> jitter(-0.15, 0.15); // of the spacing
  for (const Ball& ball : balls) {
    const double area = 4 * std::numbers::pi * ball.radius * ball.radius;
    const auto count = static_cast<int>(area * density);
    for (int i = 0; i < count; ++i) {
      const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z);
      const double unit = 1 / (ball.radius * std::sqrt(density));
      V3 n(r * std::cos(golden * i), r * std::sin(golden * i), z);
      for (int k = 0; k < 3; ++k) n[k] += unit * jitter(random);
      n.normalize();
      const V3 p = ball.center + ball.radius * n;
      const auto holds = [&](const Ball& other) {
        return &other != &ball && (p - other.center).norm() < other.radius;
      };
      if (std::ranges::any_of(balls, holds)) continue;
      cloud.p0.push_back(assume<Point3<AcquisitionSpace>>(p));
      cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace>>(n)));
    }
  }
}

// Interleaves the bits of a point's cell in a grid of 1024^3 over [-2, 2]^3.
uint32_t mortonCode(const V3& p) {
  uint32_t code = 0;
  for (int k = 0; k < 3; ++k) {
    const auto cell = static_cast<uint32_t>(std::clamp((p[k] + 2) * 256, 0.0, 1023.0));
    for (uint32_t bit = 0; bit < 10; ++bit)
      code |= (cell >> bit & 1u) << (3 * bit + static_cast<uint32_t>(k));
  }
  return code;
}

void reorder(SurfelCloud& cloud, SurfelOrder order, std::mt19937& random) {
  std::vector<size_t> places(cloud.size());
  std::iota(places.begin(), places.end(), size_t{0});
  if (order == SurfelOrder::shuffled) {
    std::ranges::shuffle(places, random);
  } else {
    std::vector<uint32_t> codes;
    for (const auto& p : cloud.p0) codes.push_back(mortonCode(p.raw().cast<double>()));
    std::ranges::stable_sort(places, {}, [&](size_t i) { return codes[i]; });
  }
  SurfelCloud sorted;
  for (const size_t i : places) {
    sorted.p0.push_back(cloud.p0[i]);
    sorted.r0.push_back(cloud.r0[i]);
  }
  cloud = std::move(sorted);
}

} // namespace

DollCloud dollCloud(size_t surfels, SurfelOrder order) {
  const std::vector<Ball> balls = dollBalls();
  double density = 1000;
  DollCloud doll;
  for (int pass = 0; pass < 3; ++pass) { // the share that is hidden within others is found by trying
    std::mt19937 random(1);
    doll.rest = {};
    sample(balls, density, random, doll.rest);
    density *= static_cast<double>(surfels) / static_cast<double>(doll.rest.size());
  }
  std::mt19937 random(2);
  reorder(doll.rest, order, random);
  // Of a hexagonal grid: the nearest six lie at the spacing, and its Gaussians sum to 1.
  const double spacing = std::sqrt(2 / (std::sqrt(3.0) * density)), sigma = kSigmaPerRadius * spacing;
  doll.rest.radius.assign(doll.rest.size(), static_cast<float>(spacing));
  doll.rest.coverage.assign(doll.rest.size(),
                            static_cast<float>(1 / (density * 2 * std::numbers::pi * sigma * sigma)));

  for (size_t i = 0; i < doll.rest.size(); ++i) {
    const V3 p = doll.rest.p0[i].raw().cast<double>();
    const Mat3<double> frame = rotationOf<double>(doll.rest.r0[i]);
    doll.deformed.p.push_back(assume<Point3<ObjectSpace>>(p));
    doll.deformed.u.push_back(assume<Direction3<ObjectSpace>>(frame.col(0)));
    doll.deformed.v.push_back(assume<Direction3<ObjectSpace>>(frame.col(1)));
    doll.deformed.handedness.push_back(Handedness::kept);
    for (const double frequency : {17.0, 20.0, 23.0}) {
      const V3 wave = frequency * p;
      doll.colors.push_back(
          static_cast<float>(0.5 + 0.2 * std::sin(wave[0]) + 0.15 * std::sin(wave[1]) + 0.1 * frame(2, 2)));
    }
  }
  return doll;
}

capture::Camera<ObjectSpace> dollCamera(int width, int height) {
  capture::Camera<ObjectSpace> camera;
  camera.lens.width = width;
  camera.lens.height = height;
  camera.lens.focalX = camera.lens.focalY = 2.1 * height;
  camera.lens.centerX = width / 2.0;
  camera.lens.centerY = height / 2.0;
  camera.cameraFromWorld = {Mat3<double>::Identity(), V3(0, 0, -5.2)};
  return camera;
}

} // namespace surflect::bench
