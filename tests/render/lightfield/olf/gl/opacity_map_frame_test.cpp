#include "render/lightfield/olf/opacity_map_frame.h"

#include "render/lightfield/lfm/tile.h"
#include "render/lightfield/olf/reference.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/olf/painted_maps.h"
#include "tests/support/random.h"

#include <cmath>
#include <map>
#include <string>

namespace surflect::olf {
namespace {

constexpr int kMapSize = 96;
constexpr std::array kMapOrders{Order::list, Order::peel};

class OpacityMapFrameTest : public ::testing::Test {
protected:
  OpacityMapFrame frameOf(const OpacityMaps& maps) const {
    return OpacityMapFrame(maps, context_->describe().limits);
  }
  static image::Image rendered(OpacityMapFrame& frame, const capture::Camera<AcquisitionSpace>& camera,
                               const MapFrameOptions& options = {}, FrameCounts* counts = nullptr) {
    std::map<std::string, double> seconds;
    FrameCounts own;
    return frame.render(camera, options, seconds, counts ? *counts : own);
  }
  static capture::Camera<AcquisitionSpace> cameraAt(const Vec3<double>& direction) {
    return studio::cameraFrom<AcquisitionSpace>(direction, kMapSize);
  }

  const std::shared_ptr<const gl::Context> context_ = gl::contextOfThread();
};

double largestDifference(const image::Image& a, const image::Image& b) {
  double largest = 0;
  for (size_t i = 0; i < a.values.size(); ++i)
    largest = std::max(largest, static_cast<double>(std::abs(a.values[i] - b.values[i])));
  return largest;
}

double psnrOf(const image::Image& a, const image::Image& b) {
  double sum = 0, covered = 0;
  for (size_t i = 0; i < a.values.size(); i += 4) {
    if (a.values[i + 3] == 0 && b.values[i + 3] == 0) continue;
    for (size_t c = 0; c < 4; ++c) sum += std::pow(a.values[i + c] - b.values[i + c], 2), ++covered;
  }
  return -10 * std::log10(sum / covered);
}

TEST_F(OpacityMapFrameTest, ListsAndLayersShowTheReference) {
  const OpacityMaps maps = paintedMaps(rowOfSpheres(4));
  OpacityMapFrame frame = frameOf(maps);
  std::mt19937 random(21);
  size_t mostLayers = 0;
  std::array<double, kMapOrders.size()> shares{};
  constexpr int kViews = 25;
  for (int view = 0; view < kViews; ++view) {
    const auto camera = cameraAt(randomUnit(random));
    const ReferencePicture reference = referencePicture(maps, camera);
    mostLayers = std::max(mostLayers, reference.mostLayers);
    for (size_t k = 0; k < kMapOrders.size(); ++k)
      shares[k] +=
          shareThatDiffers(rendered(frame, camera, {.order = kMapOrders[k]}), reference.color) / kViews;
  }
  for (size_t k = 0; k < shares.size(); ++k) {
    RecordProperty("differs" + std::to_string(k), std::to_string(shares[k]));
    EXPECT_LE(shares[k], 0.0005) << nameOf(kMapOrders[k]);
  }
  EXPECT_GE(mostLayers, 3u);
}

TEST_F(OpacityMapFrameTest, CompressedMapsAndCodebooksShowTheReference) {
  OpacityMaps maps = paintedMaps(rowOfSpheres(2), 3);
  for (const bool isScalar : {false, true}) {
    if (isScalar) {
      for (lfm::Term& term : maps.maps.terms)
        term.surface = lfm::scalarTable(term.surface, maps.maps.samples);
      maps.maps.layout = lfm::SurfaceLayout::scalar;
    }
    const OpacityMaps blocks{lfm::encoded(maps.maps), maps.white, maps.order};
    EXPECT_EQ(blocks.maps.mean.maps.coding, lfm::Coding::dxt5);
    OpacityMapFrame frame = frameOf(blocks);
    const auto camera = cameraAt({1, -2, 0.7});
    const image::Image expected = referencePicture(blocks, camera).color;
    for (const Order order : kMapOrders) {
      const double psnr = psnrOf(rendered(frame, camera, {.order = order}), expected);
      RecordProperty(nameOf(order) + std::to_string(isScalar), std::to_string(psnr));
      EXPECT_GE(psnr, 46); // drivers round blocks in their own ways
    }
  }
}

TEST_F(OpacityMapFrameTest, APassForEachTermAddsUpToOnePass) {
  const OpacityMaps maps = paintedMaps(rowOfSpheres(3));
  OpacityMapFrame frame = frameOf(maps);
  const auto camera = cameraAt({2, 1, 1});
  FrameCounts one, many;
  const image::Image single = rendered(frame, camera, {.order = Order::peel}, &one);
  const image::Image perTerm =
      rendered(frame, camera, {.order = Order::peel, .passes = lfm::Passes::perTerm}, &many);
  EXPECT_LT(largestDifference(single, perTerm), 4e-6);
  EXPECT_GE(one.layers, 2u);
  EXPECT_EQ(many.layers, one.layers);
  EXPECT_EQ(many.fragments, one.fragments);
  EXPECT_EQ(one.passes, 2 * one.layers + 1);  // depths and maps of each layer, and depths that find no more
  EXPECT_EQ(many.passes, 5 * one.layers + 1); // the mean and three terms
}

TEST_F(OpacityMapFrameTest, LayersAreAddedFromTheNearest) {
  const OpacityMaps maps = paintedMaps(rowOfSpheres(4));
  OpacityMapFrame frame = frameOf(maps);
  const auto camera = cameraAt({0.3, 1, 0.9});
  FrameCounts all;
  const image::Image whole = rendered(frame, camera, {.order = Order::peel}, &all);
  ASSERT_GE(all.layers, 3u);
  image::Image before(kMapSize, kMapSize, 4);
  for (size_t layers = 1; layers <= all.layers; ++layers) {
    FrameCounts counts;
    const image::Image picture = rendered(frame, camera, {.order = Order::peel, .layers = layers}, &counts);
    EXPECT_EQ(counts.layers, layers);
    for (size_t i = 3; i < picture.values.size(); i += 4) {
      EXPECT_GE(picture.values[i], before.values[i]);
      EXPECT_LE(picture.values[i], 1.f + 1e-6f);
    }
    before = picture;
  }
  EXPECT_EQ(before.values, whole.values);
}

TEST_F(OpacityMapFrameTest, TheFirstTermsAreThePictureOfAShorterModel) {
  const OpacityMaps maps = paintedMaps(rowOfSpheres(2));
  OpacityMapFrame frame = frameOf(maps);
  const auto camera = cameraAt({-1, 2, 3});
  for (size_t k = 0; k <= maps.maps.terms.size(); ++k) {
    OpacityMaps shorter = maps;
    shorter.maps.terms.resize(k);
    OpacityMapFrame shorterFrame = frameOf(shorter);
    for (const Order order : kMapOrders)
      EXPECT_EQ(rendered(frame, camera, {.order = order, .terms = k}).values,
                rendered(shorterFrame, camera, {.order = order}).values);
  }
}

TEST_F(OpacityMapFrameTest, EarlierFramesDoNotChangeABit) {
  const OpacityMaps maps = paintedMaps(rowOfSpheres(3));
  OpacityMapFrame frame = frameOf(maps), other = frameOf(maps);
  const auto camera = cameraAt({1, 1, 1});
  rendered(other, studio::cameraFrom<AcquisitionSpace>({0, 1, 3}, 50), {.order = Order::peel});
  for (const Order order : kMapOrders)
    EXPECT_EQ(rendered(frame, camera, {.order = order}).values,
              rendered(other, camera, {.order = order}).values);
}

// Two copies of a sphere at one place.
TEST_F(OpacityMapFrameTest, TrianglesInOnePlaneAreCompositedByListsAndOneIsShownByLayers) {
  TriangleMesh mesh = lightfield::bumpySphere(0, 12);
  const OpacityMaps once = paintedMaps(mesh, 4);
  const std::vector<std::array<uint32_t, 3>> triangles = mesh.triangles;
  mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
  const OpacityMaps twice = paintedMaps(mesh, 4); // equal content at equal corners
  OpacityMapFrame onceFrame = frameOf(once), twiceFrame = frameOf(twice);
  const auto camera = cameraAt({0.2, 1, 0.3});
  EXPECT_LE(shareThatDiffers(rendered(twiceFrame, camera), referencePicture(twice, camera).color), 0.001);
  EXPECT_LE(shareThatDiffers(rendered(twiceFrame, camera, {.order = Order::peel}),
                             referencePicture(once, camera).color),
            0.001);
}

TEST_F(OpacityMapFrameTest, TransparentMapsShowNothing) {
  OpacityMaps maps = paintedMaps(rowOfSpheres(2));
  maps.maps.terms.clear();
  std::ranges::fill(maps.maps.mean.maps.data, uint8_t{0});
  OpacityMapFrame frame = frameOf(maps);
  for (const Order order : kMapOrders) {
    FrameCounts counts;
    const image::Image picture = rendered(frame, cameraAt({1, 0, 0}), {.order = order}, &counts);
    EXPECT_TRUE(std::ranges::all_of(picture.values, [](float value) { return value == 0; }));
    if (order == Order::list) {
      EXPECT_EQ(counts.fragments, 0u);
    }
  }
}

} // namespace
} // namespace surflect::olf
