#include "render/splat/splat_raster.h"

#include "render/evaluation/measure.h"
#include "render/splat/reference.h"
#include "tests/render/scene.h"
#include "tests/support/each_simd.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <limits>

namespace surflect::splat {
namespace {

using namespace testing;

float largestDifference(const image::Image& a, const image::Image& b) {
  float largest = 0;
  for (size_t i = 0; i < a.values.size(); ++i)
    largest = std::max(largest, std::abs(a.values[i] - b.values[i]));
  return largest;
}

image::Mask discMask(int width, int height, double radius) {
  image::Mask mask(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      mask.inside[static_cast<size_t>(y * width + x)] =
          std::hypot(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0) < radius;
  return mask;
}

TEST(SplatRaster, ATinySplatCoversItsProjectedAreaWhereverItFalls) {
  Rng rng(3);
  for (int trial = 0; trial < 50; ++trial) {
    const double radius = trial % 2 ? 0.02 : 0.002, peak = 0.5, focal = 20; // sigma: 0.24 or 0.024 pixels
    Scene scene;
    addSurfel(scene.rest, {0, 0, 0}, {0, 0, 1});
    scene.rest.radius = {static_cast<float>(radius)};
    scene.rest.coverage = {static_cast<float>(peak)};
    scene.cloud = deformed(scene.rest, [&](const V3& p) { return V3(p[0], 0.5 * p[1], p[2] + 0.7 * p[0]); });
    auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 16, 16, focal);
    camera.lens.model = capture::Lens::Model::orthographic;
    camera.lens.centerX += uniform(rng, -0.5, 0.5);
    camera.lens.centerY += uniform(rng, -0.5, 0.5);
    const SplatRaster coverage = rasterize(camera, scene.splats());
    double area = 0;
    for (const float a : coverage.layerArea) area += a;
    const double sigma = kSigmaPerRadius * radius * focal;
    const double expected = peak * 2 * std::numbers::pi * sigma * (0.5 * sigma);
    EXPECT_NEAR(area / expected, 1, 0.025);
  }
}

TEST(SplatRaster, MovingCloudAndCameraTogetherChangesNothing) {
  Rng rng(4);
  Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150);
  const image::Image before = rendered(scene, camera);
  for (int trial = 0; trial < 3; ++trial) {
    const Mat3<double> rotation =
        Eigen::AngleAxisd(uniform(rng, 0, 6), randomVector(rng, 1).normalized()).toRotationMatrix();
    const Rigid<ObjectSpace, ObjectSpace> motion(rotation, randomVector(rng, 2));
    Scene moved = scene;
    for (size_t i = 0; i < moved.cloud.size(); ++i) {
      moved.cloud.p[i] = motion(scene.cloud.p[i]);
      moved.cloud.u[i] = motion(scene.cloud.u[i]);
      moved.cloud.v[i] = motion(scene.cloud.v[i]);
    }
    const image::Image after = rendered(moved, {camera.lens, camera.cameraFromWorld * motion.inverse()});
    // Each coordinate of a moved point is rounded by at most half an epsilon of its size. On the screen that
    // is `rounding` times the pixels per unit where the sphere is nearest. A colour changes by less than 1
    // over a pixel, and only the part of the motion along its gradient counts.
    float size = 0;
    for (const auto& p : moved.cloud.p) size = std::max(size, p.raw().cwiseAbs().maxCoeff());
    const double rounding = std::numeric_limits<float>::epsilon() / 2 * size;
    const double pixelsOfUnit = camera.lens.focalX / (camera.center().raw().norm() - 1);
    for (size_t i = 0; i < before.values.size(); ++i) {
      const double difference = std::abs(before.values[i] - after.values[i]);
      // 1e-5; measured 3e-6 to 7e-6, depending on the compiler.
      EXPECT_LT(difference, rounding * pixelsOfUnit);
    }
  }
}

TEST(SplatRaster, ASphereCoversItsDisc) {
  Rng rng(5);
  Scene scene;
  scene.add(unitSphere(8000, rng), unmoved, constant(red));
  const double distance = 5, sine = 1 / distance;
  for (const double focal : {100., 300., 900.}) {
    const int size = static_cast<int>(0.5 * focal);
    const image::Image image = rendered(scene, lookAt({0, 0, distance}, {0, 0, 0}, size, size, focal));
    const image::Mask disc = discMask(size, size, focal * sine / std::sqrt(1 - sine * sine));
    EXPECT_GT(image::intersectionOverUnion(image::objectMask(image), disc), 0.9915) << focal;
    const image::Mask interior = image::eroded(disc, 2);
    for (size_t i = 0; i < interior.inside.size(); ++i)
      EXPECT_TRUE(!interior.inside[i] || image.values[4 * i + 3] == 1) << focal;
  }
}

// Meshes with borders and with edges, seen face-on: opaque from one surfel spacing inside the outline, empty
// from one spacing outside.
TEST(SplatRaster, OutlinesOfSampledFacesStayWhereTheyAre) {
  TriangleMesh square, box;
  const auto addFace = [](TriangleMesh& mesh, const V3& center, const V3& a, const V3& b) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const auto& [s, t] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(V3(center + s * a + t * b)));
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  };
  addFace(square, {0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0});
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-0.5, 0.5}) {
      V3 center = V3::Zero(), a = V3::Zero(), b = V3::Zero();
      center[axis] = sign;
      a[(axis + 1) % 3] = 0.5, b[(axis + 2) % 3] = sign;
      addFace(box, center, a, b);
    }
  const double spacing = 0.05;
  for (const TriangleMesh* mesh : {&square, &box}) {
    const SurfelCloud cloud = sampleSurfels(*mesh, spacing);
    Scene scene;
    scene.add(cloud, unmoved, constant(red));
    for (const double focal : {60., 240., 700.}) { // surfels 3 to 35 pixels apart
      const int size = static_cast<int>(1.4 * focal);
      auto camera = lookAt({0, 0, 5}, {0, 0, 0}, size, size, focal);
      camera.lens.model = capture::Lens::Model::orthographic;
      const SplatRaster coverage = rasterize(camera, scene.splats());
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          const double px = (x + 0.5 - size / 2.0) / focal, py = (y + 0.5 - size / 2.0) / focal;
          const double outside = std::max(std::abs(px), std::abs(py)) - 0.5, margin = spacing + 1 / focal;
          if (outside < -margin) {
            EXPECT_EQ(coverage.alpha[coverage.pixel(x, y)], 1) << focal << ": " << px << ' ' << py;
          }
          if (outside > margin) {
            EXPECT_EQ(coverage.alpha[coverage.pixel(x, y)], 0) << focal << ": " << px << ' ' << py;
          }
        }
    }
  }
}

TEST(SplatRaster, OfTwoCloseSheetsOnlyTheFrontOneIsSeen) {
  Rng rng(6);
  const double spacing = 0.03, gap = 0.8 * kSigmaPerRadius * spacing;
  Scene scene;
  scene.add(sheet(1, 1, spacing, 0.1, rng), unmoved, constant(red));
  scene.add(
      sheet(1, 1, spacing, 0.1, rng), [&](const V3& p) { return V3(p - V3(0, 0, gap)); }, constant(green));
  for (const V3& eye : {V3(0, 0, 4), V3(2, 0, 3), V3(0, 3, 1.5)})
    for (const double focal : {600., 2400.}) {
      const image::Image image = rendered(scene, lookAt(eye, {0, 0, 0}, 128, 128, focal));
      float seen = 0;
      for (int y = 32; y < 96; ++y)
        for (int x = 32; x < 96; ++x) seen = std::max(seen, image.at(x, y)[1]);
      EXPECT_EQ(seen, 0) << eye.transpose() << ", focal " << focal;
    }
}

TEST(SplatRaster, HiddenLayersThatAreKeptChangeNoPicture) {
  Rng rng(8);
  const Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150);
  const SplatRaster plain = rasterize(camera, scene.splats()),
                    kept = rasterize(camera, scene.splats(), {.keepsHidden = true});
  EXPECT_EQ(plain.alpha, kept.alpha);
  EXPECT_GT(kept.visible.size(), plain.visible.size());
  EXPECT_LT(largestDifference(rendered(scene, camera), rendered(scene, camera, {.keepsHidden = true})), 1e-5);
  EXPECT_LT(largestDifference(depthImage(plain), depthImage(kept)), 1e-4);
  size_t hidden = 0;
  for (const RasterTile& tile : kept.tiles)
    for (const PixelLayer& layer : tile.layers) {
      hidden += layer.alpha == 0 && layer.area > 0.9f;
      EXPECT_FALSE(layer.isMedian && layer.alpha == 0);
    }
  EXPECT_GT(hidden, 1000u); // of the plane behind the sphere
}

TEST(SplatRaster, ASphereBeforeAPlaneHasNoHalo) {
  Rng rng(7);
  Scene scene;
  scene.add(unitSphere(8000, rng), unmoved, constant(red));
  scene.add(
      sheet(3, 3, 0.05, 0.1, rng), [](const V3& p) { return V3(p - V3(0, 0, 1.2)); }, constant(green));
  const int size = 160;
  const double focal = 250, radius = focal * 0.2 / std::sqrt(1 - 0.04);
  const image::Image image = rendered(scene, lookAt({0, 0, 5}, {0, 0, 0}, size, size, focal));
  const image::Mask nearDisc = discMask(size, size, radius + 2), inDisc = discMask(size, size, radius - 2);
  for (size_t i = 0; i < nearDisc.inside.size(); ++i) {
    const float* rgba = &image.values[4 * i];
    EXPECT_NEAR(rgba[0] + rgba[1], 1, 7e-7); // no gap between them
    EXPECT_TRUE(!inDisc.inside[i] || rgba[1] == 0);
    EXPECT_TRUE(nearDisc.inside[i] || rgba[0] == 0);
  }
}

TEST(SplatRaster, AMirroredCloudIsTheMirroredImage) {
  Rng rng(8);
  const SurfelCloud sphere = unitSphere(3000, rng), plane = sheet(2, 2, 0.08, 0.1, rng);
  const auto lean = [](const V3& p) { return V3(p[0] + 0.3 * p[1], p[1], p[2] - 0.2 * p[0]); };
  const auto color = [](const V3& p) { return V3(0.5 + 0.4 * p[0], 0.5 + 0.2 * p[1], 0.3); };
  const auto flip = [](const V3& p) { return V3(-p[0], p[1], p[2]); };
  Scene scene, mirrored;
  scene.add(sphere, lean, color);
  mirrored.add(
      sphere, [&](const V3& p) { return flip(lean(p)); }, [&](const V3& p) { return color(flip(p)); });
  const auto camera = lookAt({0, 1, 5}, {0, 0, 0}, 130, 90, 120);
  const image::Image a = rendered(scene, camera), b = rendered(mirrored, camera);
  float worst = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (int k = 0; k < 4; ++k)
        worst = std::max(worst, std::abs(a.at(x, y)[k] - b.at(a.width - 1 - x, y)[k]));
  EXPECT_LT(worst, 8e-6);
}

TEST(SplatRaster, DeadSurfelsDrawNothing) {
  Rng rng(9);
  Scene scene = sphereBeforePlane(rng);
  std::fill(scene.cloud.handedness.begin(), scene.cloud.handedness.end(), Handedness::dead);
  const SplatRaster coverage = rasterize(lookAt({0, 0, 5}, {0, 0, 0}, 64, 48, 60), scene.splats());
  EXPECT_EQ(coverage.counts.dead, scene.cloud.size());
  EXPECT_TRUE(coverage.visible.empty());
  EXPECT_EQ(*std::max_element(coverage.alpha.begin(), coverage.alpha.end()), 0);
}

TEST(SplatRaster, EverySplatIsCountedOnce) {
  Rng rng(10);
  Scene scene = sphereBeforePlane(rng);
  scene.cloud.handedness[3] = Handedness::dead;
  scene.cloud.p[4] = {0, std::numeric_limits<float>::quiet_NaN(), 0};
  const SplatCounts n = rasterize(lookAt({0, 0, 0.5}, {0.1, 0, 0}, 64, 48, 100), scene.splats()).counts;
  EXPECT_EQ(n.drawn + n.dead + n.notFinite + n.backFacing + n.tooNear + n.outside, scene.cloud.size());
  EXPECT_EQ(n.dead, 1u);
  EXPECT_EQ(n.notFinite, 1u);
  EXPECT_GT(n.backFacing, 1000u);
  EXPECT_GT(n.tooNear, 1000u);
  EXPECT_GT(n.outside, 100u);
}

TEST(SplatRaster, RowsSumToAlphaAndDepthIsThereWhereTheyAreNotEmpty) {
  Rng rng(11);
  const Scene scene = sphereBeforePlane(rng);
  const SplatRaster coverage = rasterize(lookAt({2, 1, 5}, {0, 0, 0}, 150, 110, 130), scene.splats());
  EXPECT_LT(coverage.visible.size(), coverage.counts.drawn); // part of the plane is hidden
  const image::Image ones = blend(coverage, std::vector<float>(coverage.visible.size(), 1), 1);
  const image::Image depth = depthImage(coverage);
  for (size_t i = 0; i < coverage.alpha.size(); ++i) {
    EXPECT_NEAR(ones.values[i], coverage.alpha[i], 6e-7);
    EXPECT_EQ(ones.values[i] > 0, std::isfinite(depth.values[i]));
  }
}

TEST(SplatRaster, TheHeaviestSplatOfAPixelIsThatOfTheReference) {
  Rng rng(12);
  const Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({1, 1.5, 5}, {0, 0, 0}, 90, 70, 80);
  for (const bool keepsHidden : {false, true}) {
    const SplatRaster raster = rasterize(camera, scene.splats(), {.keepsHidden = keepsHidden});
    const ReferenceRaster expected = referenceRaster(camera, scene.splats());
    size_t shown = 0;
    for (int y = 0; y < raster.height; ++y)
      for (int x = 0; x < raster.width; ++x) {
        const auto& weights = expected.weights[raster.pixel(x, y)];
        const auto splat = heaviestSplat(raster, x, y);
        ASSERT_EQ(splat.has_value(), raster.alpha[raster.pixel(x, y)] > 0);
        if (!splat || weights.empty()) continue;
        ++shown;
        const auto found = std::ranges::find(weights, *splat, &ReferenceWeight::splat);
        ASSERT_NE(found, weights.end());
        EXPECT_GT(found->weight, std::ranges::max(weights, {}, &ReferenceWeight::weight).weight - 1e-6);
      }
    EXPECT_GT(shown, 2000u);
  }
}

TEST(SplatRaster, EverySplatThatIsVisibleBrightensAPixel) {
  Rng rng(16);
  Scene scene;
  scene.add(unitSphere(500, rng), unmoved, constant(red));
  scene.add(
      sheet(2, 2, 0.2, 0.1, rng), [](const V3& p) { return V3(p - V3(0, 0, 1.2)); }, constant(green));
  const SplatRaster coverage = rasterize(lookAt({2, 1, 5}, {0, 0, 0}, 70, 50, 60), scene.splats());
  std::vector<float> values(coverage.visible.size(), 0);
  for (float& value : values) {
    value = 1;
    const image::Image image = blend(coverage, values, 1);
    EXPECT_GT(*std::ranges::max_element(image.values), 0);
    value = 0;
  }
}

// Measured: 83 dB.
TEST(SplatRaster, WithoutSearchForLayersThePictureIsNearlyTheSame) {
  Rng rng(19);
  const Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150);
  const image::Image full = rendered(scene, camera), fast = rendered(scene, camera, {.searchLayers = false});
  double squared = 0;
  for (size_t i = 0; i < full.values.size(); ++i) {
    const double difference = full.values[i] - fast.values[i];
    squared += difference * difference;
    if (i % 4 == 3) {
      EXPECT_NEAR(difference, 0, 1e-5);
    }
  }
  EXPECT_GT(evaluation::psnr(squared / static_cast<double>(full.values.size())), 70);
  EXPECT_NE(fast.values, full.values);
}

TEST(SplatRaster, ARasterThatIsReusedKeepsNothing) {
  Rng rng(21);
  const Scene scene = sphereBeforePlane(rng);
  SplatRaster kept;
  for (const double angle : {0.0, 2.0, 0.3, 9.0}) // the scene is off the picture, or in part of it
    for (const int width : {160, 96}) {
      const auto camera = lookAt({0, 0, 5}, {angle, 0, 0}, width, 96, 200);
      kept = rasterize(camera, scene.splats(), {}, {}, std::move(kept));
      const SplatRaster fresh = rasterize(camera, scene.splats());
      EXPECT_EQ(kept.visible, fresh.visible);
      EXPECT_EQ(kept.alpha, fresh.alpha);
      EXPECT_EQ(kept.layerArea, fresh.layerArea);
      EXPECT_EQ(blend(kept, ofVisible(kept, scene.colors), 3).values,
                blend(fresh, ofVisible(fresh, scene.colors), 3).values);
    }
}

TEST(SplatRaster, SameBitsWithAllVectorInstructions) {
  Rng rng(18);
  const Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150);
  std::vector<image::Image> images;
  for (const Simd simd : EachSimd())
    if (simd != Simd::scalar) images.push_back(rendered(scene, camera));
  for (const image::Image& image : images) EXPECT_EQ(image.values, images.front().values);
}

TEST(SplatRaster, DepthIsThatOfTheSurfaceInFront) {
  Rng rng(12);
  const Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 120, 120, 200);
  const SplatRaster coverage = rasterize(camera, scene.splats());
  const image::Image depth = depthImage(coverage);
  const image::Mask disc = discMask(120, 120, 200 * 0.2 / std::sqrt(1 - 0.04) - 2);
  const image::Mask aroundDisc = discMask(120, 120, 200 * 0.2 / std::sqrt(1 - 0.04) + 2);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 120; ++x) {
      const double q2 = (std::pow(x + 0.5 - 60, 2) + std::pow(y + 0.5 - 60, 2)) / (200 * 200);
      const double sphere =
          (5 - std::sqrt(std::max(0.0, 25 - 24 * (1 + q2)))) / (1 + q2); // |d (qx, qy, 1) - (0, 0, 5)| = 1
      const size_t i = coverage.pixel(x, y);
      EXPECT_NEAR(disc.inside[i] ? depth.values[i] : sphere, sphere, 0.004);
      EXPECT_NEAR(aroundDisc.inside[i] ? 6.5 : depth.values[i], 6.5, 5e-6);
    }
}

TEST(SplatRaster, SameBitsForAnyNumberOfThreads) {
  Rng rng(13);
  const Scene scene = sphereBeforePlane(rng);
  const auto camera = lookAt({1, 1, 5}, {0, 0, 0}, 200, 150, 180);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    const auto with = [&](size_t threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      return rendered(scene, camera);
    };
    EXPECT_EQ(with(1).values, with(2).values);
  }
}

// Many fragments in each pixel.
TEST(SplatRaster, AStackOfThinnedCloudsIsTheCloud) {
  Rng rng(14);
  Scene once, stacked;
  const SurfelCloud rest = sheet(0.5, 0.5, 0.1, 0.1, rng);
  const auto color = [](const V3& p) { return V3(0.5 + 0.4 * p[0], 0.5 + 0.2 * p[1], 0.3); };
  SurfelCloud thinned = rest;
  constexpr int copies = 300;
  for (float& coverage : thinned.coverage) coverage /= copies;
  once.add(rest, unmoved, color);
  for (int i = 0; i < copies; ++i) stacked.add(thinned, unmoved, color);
  const auto camera = lookAt({0.2, 0.3, 2}, {0, 0, 0}, 40, 36, 80);
  const image::Image wanted = rendered(once, camera);
  EXPECT_GT(wanted.at(20, 18)[3], 0.9f);
  EXPECT_LT(largestDifference(wanted, rendered(stacked, camera)), 1e-4);
}

TEST(SplatRaster, ACloudAroundTheViewerGivesFiniteValuesWithinBounds) {
  Rng rng(15);
  Scene scene;
  scene.add(sheet(1, 1, 0.05, 0.1, rng), unmoved, constant(red));
  scene.add(unitSphere(2000, rng), unmoved, constant(green));
  for (const V3& eye : {V3(0, 0, 1e-3), V3(0.3, 0.1, 0.02), V3(0, 0, 0.9)}) {
    const image::Image image = rendered(scene, lookAt(eye, {0.5, 0.1, 0}, 96, 64, 40));
    for (const float value : image.values) EXPECT_TRUE(value >= 0 && value <= 1.00001f);
  }
}

} // namespace
} // namespace surflect::splat
