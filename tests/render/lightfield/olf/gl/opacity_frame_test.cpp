#include "render/lightfield/olf/opacity_frame.h"

#include "render/lightfield/olf/packing.h"
#include "render/lightfield/olf/reference.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/olf/painted_field.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/support/random.h"

#include <cmath>
#include <map>
#include <string>

namespace surflect::olf {
namespace {

constexpr int kSize = 128;
constexpr std::array kOrders{Order::list, Order::peel, Order::bsp};

class OpacityFrameTest : public ::testing::Test {
protected:
  static image::Image rendered(OpacityFrame& frame, const ViewBlender& blender,
                               const capture::Camera<AcquisitionSpace>& camera,
                               FrameCounts* counts = nullptr) {
    std::map<std::string, double> seconds;
    FrameCounts own;
    return frame.render(camera, blender.blends(camera.center().raw()), seconds, counts ? *counts : own);
  }

  const std::shared_ptr<const gl::Context> context_ = gl::contextOfThread();
};

TEST_F(OpacityFrameTest, AllOrdersShowTheReference) {
  for (const Blending method : {Blending::vdtm, Blending::ulr}) {
    const OpacityField field = paintedField(rowOfSpheres(4), 40, kSize, method);
    const ViewBlender blender(field);
    std::vector<std::unique_ptr<OpacityFrame>> frames;
    for (const Order order : kOrders) frames.push_back(std::make_unique<OpacityFrame>(field, order));
    std::mt19937 random(11);
    size_t mostLayers = 0;
    std::array<double, kOrders.size()> shares{};
    constexpr int kViews = 25;
    for (int view = 0; view < kViews; ++view) {
      const auto camera = studio::cameraFrom<AcquisitionSpace>(randomUnit(random), kSize);
      const ReferencePicture reference = referencePicture(field, blender, camera),
                             sorted = referencePicture(field, blender, camera, over);
      mostLayers = std::max(mostLayers, reference.mostLayers);
      for (size_t k = 0; k < frames.size(); ++k)
        shares[k] += shareThatDiffers(rendered(*frames[k], blender, camera),
                                      kOrders[k] == Order::bsp ? sorted.color : reference.color) /
                     kViews;
    }
    for (size_t k = 0; k < shares.size(); ++k)
      RecordProperty("differs" + std::to_string(static_cast<int>(method)) + std::to_string(k),
                     std::to_string(shares[k]));
    for (size_t k = 0; k < shares.size(); ++k)
      EXPECT_LE(shares[k], kOrders[k] == Order::bsp ? 0.0005 : 0.0002) << "order " << k;
    EXPECT_GE(mostLayers, 3u);
  }
}

TEST_F(OpacityFrameTest, ListsGrowUntilAllFragmentsFit) {
  // Many spheres at one place: more fragments than pixels.
  TriangleMesh mesh;
  for (int k = 0; k < 20; ++k) {
    const TriangleMesh sphere = lightfield::bumpySphere(0, 10);
    const auto shift = static_cast<uint32_t>(mesh.positions.size());
    for (const auto& p : sphere.positions) {
      const Vec3<float> q = (1 - 0.02f * static_cast<float>(k)) * p.raw();
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(q));
    }
    for (const auto& [a, b, c] : sphere.triangles)
      mesh.triangles.push_back({a + shift, b + shift, c + shift});
  }
  const OpacityField field = paintedField(std::move(mesh), 20, kSize, Blending::ulr);
  const ViewBlender blender(field);
  OpacityFrame frame(field, Order::list);
  FrameCounts counts, again;
  const auto camera = studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, kSize);
  const image::Image picture = rendered(frame, blender, camera, &counts);
  EXPECT_GT(counts.fragments, static_cast<size_t>(kSize * kSize));
  EXPECT_EQ(counts.passes, 2u);
  EXPECT_LE(shareThatDiffers(picture, referencePicture(field, blender, camera).color), 0.001);
  EXPECT_EQ(rendered(frame, blender, camera, &again).values, picture.values);
  EXPECT_EQ(again.passes, 1u);
}

TEST_F(OpacityFrameTest, PeelingStopsAtAnEmptyLayer) {
  const OpacityField field = paintedField(lightfield::bumpySphere(0, 16), 30, kSize, Blending::vdtm);
  const ViewBlender blender(field);
  OpacityFrame frame(field, Order::peel);
  FrameCounts counts;
  rendered(frame, blender, studio::cameraFrom<AcquisitionSpace>({1, 0, 0.3}, kSize), &counts);
  EXPECT_EQ(counts.passes, 2u); // one layer faces the viewer
}

// Triangles around the viewer are seen edge-on: rounding gives them any depth.
TEST_F(OpacityFrameTest, PeelingEndsForAViewerAtAVertex) {
  TriangleMesh mesh = slf::testing::bumpySphere(4, 7);
  const Vec3<double> far(512, -256, 1024);
  for (auto& p : mesh.positions)
    p = assume<Point3<AcquisitionSpace>>(Vec3<double>(p.raw().cast<double>() + far));
  const OpacityField field = paintedField(std::move(mesh), 20, 16, Blending::ulr);
  const ViewBlender blender(field);
  OpacityFrame frame(field, Order::peel);
  std::mt19937 random(13);
  std::uniform_real_distribution<double> number(0, 1);
  for (const auto& vertex : field.mesh.positions)
    for (int trial = 0; trial < 10; ++trial) {
      capture::Camera<AcquisitionSpace> camera;
      camera.lens.width = camera.lens.height = 60;
      camera.lens.focalX = camera.lens.focalY = 10 + 40 * number(random);
      camera.lens.centerX = 120 * number(random) - 30, camera.lens.centerY = 30;
      camera.cameraFromWorld = {Mat3<double>::Identity(), -vertex.cast<double>().raw()};
      FrameCounts counts;
      for (const float value : rendered(frame, blender, camera, &counts).values)
        ASSERT_TRUE(std::isfinite(value));
      ASSERT_LE(counts.passes, 1 + field.mesh.triangles.size());
    }
}

TEST_F(OpacityFrameTest, EqualDepthsAreInTheOrderOfTheMesh) {
  // Two copies of a sphere, each with views of its own.
  TriangleMesh mesh = lightfield::bumpySphere(0, 10);
  const auto shift = static_cast<uint32_t>(mesh.triangles.size());
  const std::vector<std::array<uint32_t, 3>> once = mesh.triangles;
  mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  const OpacityField field = paintedField(std::move(mesh), 30, kSize, Blending::ulr);
  ASSERT_EQ(field.mesh.triangles.size(), 2 * shift);
  const ViewBlender blender(field);
  OpacityFrame frame(field, Order::list);
  const auto camera = studio::cameraFrom<AcquisitionSpace>({0.2, 1, 0.3}, kSize);
  EXPECT_LE(
      shareThatDiffers(rendered(frame, blender, camera), referencePicture(field, blender, camera).color),
      0.001);
}

TEST_F(OpacityFrameTest, TransparentViewsShowNothing) {
  OpacityField field = paintedField(rowOfSpheres(2), 20, kSize, Blending::vdtm);
  std::ranges::fill(field.packed.texels, Texel{});
  const ViewBlender blender(field);
  for (const Order order : kOrders) {
    OpacityFrame frame(field, order);
    const image::Image picture =
        rendered(frame, blender, studio::cameraFrom<AcquisitionSpace>({1, 0, 0}, kSize));
    EXPECT_TRUE(std::ranges::all_of(picture.values, [](float value) { return value == 0; }));
  }
}

TEST_F(OpacityFrameTest, CroppedAndScaledViewsAreSampledInPlace) {
  OpacityField field = paintedField(lightfield::bumpySphere(0, 16), 30, kSize, Blending::ulr);
  std::mt19937 random(12);
  for (PackedView& view : field.packed.views) {
    view.low = {static_cast<double>(random() % 8), static_cast<double>(random() % 8)};
    view.scale = {0.6, 0.7};
    view.width = 40, view.height = 45;
  }
  const ViewBlender blender(field);
  for (const Order order : kOrders) {
    OpacityFrame frame(field, order);
    const auto camera = studio::cameraFrom<AcquisitionSpace>({-1, 0.4, 2}, kSize);
    EXPECT_LE(
        shareThatDiffers(rendered(frame, blender, camera), referencePicture(field, blender, camera).color),
        0.001);
  }
}

// Drivers mix the two colours of a block in few bits.
TEST_F(OpacityFrameTest, BlocksShowTheReferenceUpToTheirRounding) {
  OpacityField field = paintedField(rowOfSpheres(2), 20, kSize, Blending::vdtm);
  field.packed = withBlocks(field.packed);
  const ViewBlender blender(field);
  for (const Order order : kOrders) {
    OpacityFrame frame(field, order);
    EXPECT_EQ(frame.textureBytes(), size_t{20 * kSize * kSize});
    const auto camera = studio::cameraFrom<AcquisitionSpace>({1, 0.3, 0.5}, kSize);
    const image::Image picture = rendered(frame, blender, camera);
    const image::Image wanted =
        referencePicture(field, blender, camera, order == Order::bsp ? over : inFrontOf).color;
    double squares = 0, count = 0, shown = 0, differ = 0;
    for (size_t i = 0; i < picture.values.size(); i += 4) {
      const bool isWanted = wanted.values[i + 3] > 0, isThere = picture.values[i + 3] > 0;
      shown += isWanted || isThere, differ += isWanted != isThere; // pixels at the outline
      if (!isWanted || !isThere) continue;
      for (size_t c = i; c < i + 4; ++c)
        squares += std::pow(static_cast<double>(picture.values[c] - wanted.values[c]), 2), ++count;
    }
    const double decibels = -10 * std::log10(squares / count);
    RecordProperty(nameOf(order), std::to_string(decibels));
    RecordProperty(std::string(nameOf(order)) + "_outline", std::to_string(differ / shown));
    EXPECT_GE(decibels, 50) << nameOf(order);
    EXPECT_LE(differ, 0.001 * shown) << nameOf(order);
  }
}

} // namespace
} // namespace surflect::olf
