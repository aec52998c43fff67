#include "tests/stability/entry.h"

#include "tests/render/scene.h"

#include <Eigen/LU>

#include <array>

namespace surflect::stability {
namespace {

using testing::addSurfel;
using testing::constant;
using testing::green;
using testing::lookAt;
using testing::red;
using testing::rendered;
using testing::Rng;
using testing::Scene;
using testing::sheet;
using testing::uniform;
using testing::unitSphere;
using testing::unmoved;
using testing::V3;

constexpr double kFixedTolerance = 0.05; // in depth, of the naive form

// Splats by the affine map at their centres, without low-pass and near plane: colours of those within a fixed
// depth of the first, over the sum of their weights.
image::Image plainSplats(const Scene& scene, const capture::Camera<ObjectSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  const bool isPinhole = lens.model == capture::Lens::Model::pinhole;
  const auto pixels = static_cast<size_t>(lens.width) * static_cast<size_t>(lens.height);
  std::vector<std::array<double, 5>> sums(pixels, {0, 0, 0, 0, 1e300}); // colour, weight, nearest depth
  for (const bool isColor : {false, true})
    for (size_t i = 0; i < scene.rest.size(); ++i) {
      const V3 p = camera.cameraFromWorld(scene.cloud.p[i].cast<double>()).raw();
      const V3 u = camera.cameraFromWorld(scene.cloud.u[i].cast<double>()).raw(),
               v = camera.cameraFromWorld(scene.cloud.v[i].cast<double>()).raw();
      if (u.cross(v).dot(isPinhole ? V3(-p) : V3(0, 0, 1)) <= 0) continue;
      const double depth = -p[2], scale = isPinhole ? 1 / depth : 1;
      const double x = lens.centerX + lens.focalX * scale * p[0],
                   y = lens.centerY - lens.focalY * scale * p[1];
      Eigen::Matrix<double, 2, 3> projection;
      projection << lens.focalX * scale, 0, isPinhole ? lens.focalX * p[0] * scale * scale : 0, //
          0, -lens.focalY * scale, isPinhole ? -lens.focalY * p[1] * scale * scale : 0;
      Eigen::Matrix<double, 3, 2> tangents;
      tangents << u, v;
      const double s = kSigmaPerRadius * double{scene.rest.radius[i]};
      const Eigen::Matrix2d root = s * projection * tangents;
      const Eigen::Matrix2d inverse = Eigen::Matrix2d(root * root.transpose()).inverse();
      const double reach = 4 * root.norm();
      for (int py = std::max(0, static_cast<int>(y - reach));
           py < std::min<double>(lens.height, y + reach + 1); ++py)
        for (int px = std::max(0, static_cast<int>(x - reach));
             px < std::min<double>(lens.width, x + reach + 1); ++px) {
          const Eigen::Vector2d d(px + 0.5 - x, py + 0.5 - y);
          const double weight = double{scene.rest.coverage[i]} * std::exp(-d.dot(inverse * d) / 2);
          auto& sum = sums[static_cast<size_t>(py * lens.width + px)];
          if (!isColor) {
            if (!(weight < 1e-3)) sum[4] = std::min(sum[4], depth);
            continue;
          }
          if (depth > sum[4] + kFixedTolerance) continue;
          for (size_t k = 0; k < 3; ++k) sum[k] += weight * double{scene.colors[3 * i + k]};
          sum[3] += weight;
        }
    }
  image::Image picture(lens.width, lens.height, 4);
  for (size_t i = 0; i < pixels; ++i) {
    const double alpha = std::min(1.0, sums[i][3]);
    for (size_t k = 0; k < 3; ++k)
      picture.values[4 * i + k] = sums[i][3] == 0 ? 0.f : static_cast<float>(alpha * sums[i][k] / sums[i][3]);
    picture.values[4 * i + 3] = static_cast<float>(alpha);
  }
  return picture;
}

// Values outside of 0..1, or not finite.
double wrongValues(const image::Image& picture) {
  return static_cast<double>(
      std::ranges::count_if(picture.values, [](float value) { return !(value >= 0 && value <= 1.00001f); }));
}

capture::Camera<ObjectSpace> orthographic(int size, double pixelsPerUnit) {
  auto camera = lookAt({0, 0, 5}, {0, 0, 0}, size, size, pixelsPerUnit);
  camera.lens.model = capture::Lens::Model::orthographic;
  return camera;
}

Measured outOfRange(const Scene& scene, const capture::Camera<ObjectSpace>& camera) {
  return {wrongValues(plainSplats(scene, camera)), wrongValues(rendered(scene, camera))};
}

// A sheet turned away from the viewer until the given angle is left.
Measured edgeOn(double degreesLeft) {
  const double angle = (90 - degreesLeft) * std::numbers::pi / 180;
  Rng rng(2);
  Scene scene;
  scene.add(
      sheet(1, 1, 0.05, 0.1, rng),
      [=](const V3& p) { return V3(p[0], p[1] * std::cos(angle), -p[1] * std::sin(angle)); }, constant(red));
  const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 64, 64, 100);
  // Brightness of its strip over the strip's area; edge-on, the area is 0 and only the low-pass shows.
  const auto excess = [&](const image::Image& picture) {
    double sum = 0;
    for (size_t i = 3; i < picture.values.size(); i += 4) sum += double{picture.values[i]};
    const double wanted = 40 * 40 * std::cos(angle);
    return std::abs(sum - wanted) / 64 / 64;
  };
  return {excess(plainSplats(scene, camera)), excess(rendered(scene, camera))};
}

// Largest error of the area that a tiny splat covers, relative to its projected area, over its places in a
// pixel.
Measured tinySplat(double sigmaPixels) {
  Rng rng(3);
  Measured worst;
  for (int trial = 0; trial < 40; ++trial) {
    Scene scene;
    const double radius = sigmaPixels / (kSigmaPerRadius * 20);
    addSurfel(scene.rest, {0, 0, 0}, {0, 0, 1});
    scene.rest.radius = {static_cast<float>(radius)};
    scene.rest.coverage = {0.5f};
    scene.cloud = testing::deformed(scene.rest, unmoved);
    scene.colors = {1, 0, 0};
    auto camera = orthographic(16, 20);
    camera.lens.centerX += uniform(rng, -0.5, 0.5), camera.lens.centerY += uniform(rng, -0.5, 0.5);
    const double expected = 0.5 * 2 * std::numbers::pi * sigmaPixels * sigmaPixels;
    double naive = 0, ours = 0;
    const image::Image plain = plainSplats(scene, camera);
    for (size_t i = 3; i < plain.values.size(); i += 4) naive += double{plain.values[i]};
    for (const float area : splat::rasterize(camera, scene.splats()).layerArea) ours += double{area};
    raise(worst.naive, std::abs(naive / expected - 1));
    raise(worst.ours, std::abs(ours / expected - 1));
  }
  return worst;
}

// Largest share of a sheet's colour that shines through another one before it.
Measured shineThrough(double gap, double spacing) {
  Rng rng(4);
  Scene scene;
  scene.add(sheet(1, 1, spacing, 0.1, rng), unmoved, constant(red));
  scene.add(
      sheet(1, 1, spacing, 0.1, rng), [=](const V3& p) { return V3(p - V3(0, 0, gap)); }, constant(green));
  const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 48, 48, 200); // sees the middle of the sheets
  Measured worst;
  const image::Image plain = plainSplats(scene, camera), ours = rendered(scene, camera);
  for (size_t i = 1; i < plain.values.size(); i += 4) {
    raise(worst.naive, double{plain.values[i]});
    raise(worst.ours, double{ours.values[i]});
  }
  return worst;
}

// Texture of waves a few surfels long.
V3 waves(const V3& p, double spacing) {
  const double k = 2 * std::numbers::pi / (6 * spacing);
  return {0.5 + 0.25 * std::sin(k * p[0]) + 0.25 * std::sin(0.83 * k * p[1]),
          0.5 + 0.4 * std::sin(k * (0.6 * p[0] + 0.8 * p[1])), 0.5 + 0.4 * std::sin(0.4 * k * p[0])};
}

// A minified texture; its truth is a box filter over each pixel.
Pictures minifiedPictures(double surfelsPerPixel, int size) {
  Rng rng(6);
  constexpr double spacing = 0.01;
  const double pixel = spacing * surfelsPerPixel, half = pixel * (size / 2 + 3);
  Scene scene;
  scene.add(sheet(half, half, spacing, 0.2, rng), unmoved, [=](const V3& p) { return waves(p, spacing); });
  const auto camera = orthographic(size, 1 / pixel);
  Pictures pictures{plainSplats(scene, camera), rendered(scene, camera), image::Image(size, size, 4)};
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      constexpr int n = 24;
      V3 truth = V3::Zero();
      for (int s = 0; s < n * n; ++s)
        truth += waves(V3((x - size / 2.0 + (s % n + 0.5) / n) * pixel,
                          (size / 2.0 - y - (s / n + 0.5) / n) * pixel, 0),
                       spacing) /
                 (n * n);
      for (int k = 0; k < 3; ++k)
        pictures.truth.at(x, y)[static_cast<size_t>(k)] = static_cast<float>(truth[k]);
      pictures.truth.at(x, y)[3] = 1;
    }
  return pictures;
}

// RMS error of a minified texture.
Measured minified(double surfelsPerPixel) {
  const Pictures pictures = minifiedPictures(surfelsPerPixel, 12);
  const auto rms = [&](const image::Image& picture) {
    double squares = 0;
    for (size_t i = 0; i < picture.values.size(); ++i)
      if (i % 4 < 3) squares += std::pow(double{picture.values[i]} - double{pictures.truth.values[i]}, 2);
    return std::sqrt(squares / (3 * 12 * 12));
  };
  return {rms(pictures.naive), rms(pictures.ours)};
}

// A red sphere that a green one with a radius of `inner` almost fills.
Pictures spherePictures(double inner) {
  Rng rng(5);
  const SurfelCloud cloud = unitSphere(6000, rng);
  const auto lit = [](const V3& color) {
    return [=](const V3& p) {
      return V3((0.3 + 0.7 * std::max(0.0, p.normalized().dot(V3(0.48, 0.6, 0.64)))) * color);
    };
  };
  Scene outer, both;
  outer.add(cloud, unmoved, lit(red));
  both.add(cloud, unmoved, lit(red));
  both.add(
      cloud, [=](const V3& p) { return V3(inner * p); }, lit(green));
  const auto camera = lookAt({0, 0, 4}, {0, 0, 0}, 144, 144, 250);
  return {plainSplats(both, camera), rendered(both, camera), rendered(outer, camera)};
}

} // namespace

Group splatGroup() {
  return {
      "EWA splatting",
      "splats by the affine map at their centres, without low-pass and near plane, layers by a fixed depth "
      "of 0.05",
      {
          {"sheet 1 degree from edge-on", "its covered area", "error of area, share of the picture", 0.013,
           [] { return edgeOn(1); }},
          {"sheet 0.001 degrees from edge-on", "its covered area", "error of area, share of the picture",
           1.4e-5, [] { return edgeOn(0.001); }},
          {"splat of half a pixel", "its covered area", "relative error", 0.05,
           [] { return tinySplat(0.5); }},
          {"splat of a hundredth of a pixel", "its covered area", "relative error", 0.016,
           [] { return tinySplat(0.01); }},
          {"splat 100 times larger than the screen", "values within 0..1", "wrong values", 0,
           [] {
             Scene scene;
             addSurfel(scene.rest, {0, 0, 0}, {0, 0, 1});
             scene.rest.radius = {100}, scene.rest.coverage = {1}, scene.colors = {1, 0, 0};
             scene.cloud = testing::deformed(scene.rest, unmoved);
             return outOfRange(scene, lookAt({0, 0, 5}, {0, 0, 0}, 32, 32, 30));
           }},
          {"sheet through the near plane and the viewer", "values within 0..1", "wrong values", 0,
           [] {
             Rng rng(8);
             Scene scene;
             scene.add(sheet(1, 1, 0.05, 0.1, rng), unmoved, constant(red));
             return outOfRange(scene, lookAt({0.3, 0.1, 1e-3}, {0.5, 0.1, 0}, 64, 48, 40));
           }},
          {"sphere behind the camera", "nothing", "pixels drawn", 0,
           [] {
             Rng rng(1);
             Scene scene;
             scene.add(
                 unitSphere(500, rng), [](const V3& p) { return V3(p + V3(0, 0, 10)); }, constant(red));
             const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 32, 32, 30);
             const auto drawn = [](const image::Image& picture) {
               double count = 0;
               for (size_t i = 3; i < picture.values.size(); i += 4) count += picture.values[i] > 0.01f;
               return count;
             };
             return Measured{drawn(plainSplats(scene, camera)), drawn(rendered(scene, camera))};
           }},
          {"two sheets 0.03 apart, surfels 0.02 apart", "the front one alone", "largest share of the other",
           0.01, [] { return shineThrough(0.03, 0.02); }},
          {"two sheets 0.001 apart, surfels 0.02 apart", "both blend: nearer than a splat can tell",
           "largest share of the other", 1, [] { return shineThrough(0.001, 0.02); }},
          {"every surfel twice", "the picture of each once", "largest difference", 0.01,
           [] {
             Rng rng(11);
             const SurfelCloud cloud = unitSphere(3000, rng);
             SurfelCloud doubled;
             for (size_t i = 0; i < 2 * cloud.size(); ++i) {
               doubled.p0.push_back(cloud.p0[i / 2]);
               doubled.r0.push_back(cloud.r0[i / 2]);
             }
             estimateSplats(doubled);
             const auto color = [](const V3& p) {
               return V3(0.5 + 0.4 * std::sin(2 * p[0]), 0.5 + 0.3 * p[1], 0.4);
             };
             Scene once, twice;
             once.add(cloud, unmoved, color);
             twice.add(doubled, unmoved, color);
             const auto camera = lookAt({0.5, 0.5, 4}, {0, 0, 0}, 48, 48, 60);
             const auto apart = [](const image::Image& a, const image::Image& b) {
               double largest = 0;
               for (size_t i = 0; i < a.values.size(); ++i)
                 if (a.values[i - i % 4 + 3] > 0.999f && b.values[i - i % 4 + 3] > 0.999f)
                   raise(largest, std::abs(double{a.values[i]} - double{b.values[i]}));
               return largest;
             };
             return Measured{apart(plainSplats(once, camera), plainSplats(twice, camera)),
                             apart(rendered(once, camera), rendered(twice, camera))};
           }},
          {"picture of one pixel", "the mean of a sheet of waves", "largest error", 0.08,
           [] {
             Rng rng(6);
             Scene scene;
             scene.add(sheet(1.5, 1.5, 0.05, 0.1, rng), unmoved, [](const V3& p) { return waves(p, 0.05); });
             const auto camera = orthographic(1, 0.5);
             const auto error = [](const image::Image& picture) {
               double largest = 0;
               for (size_t k = 0; k < 3; ++k) raise(largest, std::abs(double{picture.values[k]} - 0.5));
               return largest;
             };
             return Measured{error(plainSplats(scene, camera)), error(rendered(scene, camera))};
           }},
          {"minification by 4", "a box filter over the pixel", "RMS error", 0.01, [] { return minified(4); }},
          {"minification by 8", "a box filter over the pixel", "RMS error", 0.06, [] { return minified(8); }},
          {"minification by 16", "a box filter over the pixel", "RMS error", 0.065,
           [] { return minified(16); }},
      },
      {{"minified", [] { return minifiedPictures(8, 72); }},
       {"layers", [] { return spherePictures(0.96); }}}};
}

} // namespace surflect::stability
