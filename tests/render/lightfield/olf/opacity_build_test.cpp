#include "render/lightfield/olf/build.h"

#include "render/lightfield/olf/opacity_file.h"
#include "render/lightfield/olf/opacity_hull.h"
#include "render/lightfield/olf/packing.h"
#include "render/lightfield/olf/reference.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/render/lightfield/olf/painted_field.h"
#include "tests/support/random.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>

namespace surflect::olf {
namespace {

namespace fs = std::filesystem;

TEST(ObjectWindow, HoldsAllAlphaAndAPixelAround) {
  image::Image picture(9, 7, 4);
  EXPECT_EQ(objectWindow(picture).width(), 1); // all transparent
  picture.at(4, 2)[3] = 1e-4f;
  picture.at(8, 3)[3] = 1;
  const image::PixelWindow window = objectWindow(picture);
  EXPECT_EQ(window.x0, 3);
  EXPECT_EQ(window.x1, 9);
  EXPECT_EQ(window.y0, 1);
  EXPECT_EQ(window.y1, 5);
}

TEST(MendInvalid, TakesTheMeanOfTheNeighbours) {
  image::Image picture(3, 1, 4);
  picture.values = {1, 0, 0, 1, std::numeric_limits<float>::quiet_NaN(), 0, 0, 1, 3, 0, 0, 1};
  mendInvalid(picture);
  EXPECT_EQ(picture.at(1, 0)[0], 2);
  EXPECT_EQ(picture.at(0, 0)[0], 1);
  image::Image alone(1, 1, 4);
  alone.values = {std::numeric_limits<float>::infinity(), 0, 0, 1};
  mendInvalid(alone);
  EXPECT_EQ(alone.values, std::vector<float>(4, 0));
}

TEST(CoarseAround, HoldsTheMesh) {
  const TriangleMesh sphere = lightfield::bumpySphere(0.05, 48), coarse = coarseAround(sphere, 200);
  EXPECT_LE(coarse.triangles.size(), 200u);
  const RayCaster<AcquisitionSpace> rays(coarse);
  size_t outside = 0;
  for (const auto& p : sphere.positions) {
    const Vec3<double> d = p.cast<double>().raw().normalized();
    const auto hit = rays.firstHit(Point3<AcquisitionSpace, double>(0, 0, 0),
                                   assume<Direction3<AcquisitionSpace, double>>(d));
    outside += !hit || hit->distance < p.cast<double>().raw().norm() - 0.01;
  }
  EXPECT_LE(outside, sphere.positions.size() / 50);
}

// Views of a sphere, and fields of it, made once.
class OpacityBuild : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    shared_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 30, .lights = 0, .size = 32}, *shared_ / "capture");
    lightfield::Views views(*shared_ / "capture");
    report_ = build(views, {}, *shared_ / "field");
  }
  static void TearDownTestSuite() { shared_.reset(); }
  void SetUp() override { fs::copy(*shared_ / "field", folder_.path(), fs::copy_options::recursive); }

  static OpacityField read(const fs::path& path) {
    return readField(lightfield::LightFieldFolder(path, kFormat, kVersion));
  }
  // Writes a field, and returns why it cannot be read.
  std::string errorOf(const OpacityField& field) const {
    const lightfield::LightFieldFolder before(*shared_ / "field", kFormat, kVersion);
    writeField(field, before.rig(), folder_.path());
    return image::errorOf([&] { read(folder_.path()); });
  }

  static inline std::unique_ptr<image::TemporaryFolder> shared_;
  static inline BuildReport report_;
  image::TemporaryFolder folder_;
};

TEST_F(OpacityBuild, IsReadAsItWasBuilt) {
  const OpacityField field = read(folder_.path());
  EXPECT_EQ(field.cameras.size(), 30u);
  EXPECT_EQ(field.mesh.triangles.size(), report_.triangles);
  EXPECT_EQ(report_.unseenVertices, 0u);
  EXPECT_EQ(field.packed.width, report_.width);
  EXPECT_EQ(report_.scale, 1);
  EXPECT_EQ(report_.packedBytes, 8u * 30u * static_cast<size_t>(report_.width * report_.height));
  EXPECT_LT(report_.packedBytes, report_.pictureBytes);
  EXPECT_EQ(report_.bytes, lightfield::LightFieldFolder(folder_.path(), kFormat, kVersion).bytes());
}

TEST_F(OpacityBuild, AVertexHasTheViewsThatItsRingFaces) {
  const OpacityField field = read(folder_.path());
  const lfm::Rings rings(field.mesh);
  size_t missing = 0, all = 0;
  for (const uint32_t vertex : rings.vertices()) {
    std::vector<uint32_t> facing;
    for (uint32_t view = 0; view < field.cameras.size(); ++view) {
      bool faces = true; // the sphere is convex: nothing is hidden otherwise
      for (const lfm::RingTriangle& around : rings.around(vertex)) {
        const Vec3<double> corner =
            field.mesh.positions[field.mesh.triangles[around.triangle][0]].cast<double>().raw();
        faces &= areaVector(field.mesh, around.triangle).dot(field.cameras[view].center().raw() - corner) > 0;
      }
      if (faces) facing.push_back(view);
    }
    const auto of = field.visible.of(vertex);
    EXPECT_TRUE(std::ranges::includes(facing, of));
    missing += facing.size() - of.size(); // rays that graze the surface
    all += facing.size();
  }
  EXPECT_LE(static_cast<double>(missing), 0.01 * static_cast<double>(all));
}

TEST_F(OpacityBuild, AllViewsCountIfVisibilityIsIgnored) {
  lightfield::Views views(*shared_ / "capture");
  const BuildReport report = build(views, {.visible = Visible::all, .triangles = 100}, folder_ / "all");
  EXPECT_EQ(report.visibleViews, 30);
}

TEST_F(OpacityBuild, WhatNoViewSeesBlendsTheViewsThatFaceIt) {
  lightfield::Views views(*shared_ / "capture");
  TriangleMesh nested = lightfield::bumpySphere(0, 12);
  const auto outer = static_cast<uint32_t>(nested.positions.size());
  for (uint32_t i = 0; i < outer; ++i) { // a smaller sphere inside
    const Vec3<float> p = 0.5f * nested.positions[i].raw();
    nested.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
  }
  for (size_t t = 0, count = nested.triangles.size(); t < count; ++t) {
    const auto [a, b, c] = nested.triangles[t];
    nested.triangles.push_back({a + outer, b + outer, c + outer});
  }
  views.replaceMesh(withoutUnused(withoutFlat(nested)));
  const lfm::Rings rings(views.mesh());
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  const VisibleViews visible = visibleViews(views, training, rings, Visible::ring);
  EXPECT_EQ(visible.unseenVertices, rings.vertices().size() / 2);
  for (const uint32_t vertex : rings.vertices()) EXPECT_FALSE(visible.of(vertex).empty());
}

TEST_F(OpacityBuild, ViewsAreScaledDownToTheBudget) {
  const lightfield::Views views(*shared_ / "capture");
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  PackingReport report;
  const PackedViews packed = packViews(views, training, {.budget = 40000}, report);
  EXPECT_LE(packed.bytes(), 40000u);
  EXPECT_GE(packed.bytes(), 30000u);
  EXPECT_LT(report.scale, 1);
  EXPECT_THROW(packViews(views, training, {.budget = 100}, report), Error);
  // Blocks take an eighth: the same budget holds views of the full size.
  const PackedViews blocks = packViews(views, training, {.budget = 40000, .s3tc = true}, report);
  EXPECT_LE(blocks.bytes(), 40000u);
  EXPECT_EQ(report.scale, 1);
  packViews(views, training, {.budget = 10000, .s3tc = true}, report);
  EXPECT_LT(report.scale, 1);
  EXPECT_THROW(packViews(views, training, {.budget = 16 * 30 - 1, .s3tc = true}, report), Error);
}

// A view of 12 x 8 texels of one hue: transparent, half transparent and opaque ones from left to right, of
// radiance 2 above and `lower` below.
PackedViews threeAlphas(float lower) {
  PackedViews packed;
  packed.width = 12, packed.height = 8;
  packed.views.resize(1);
  packed.views[0].width = packed.width, packed.views[0].height = packed.height;
  for (int y = 0; y < packed.height; ++y)
    for (int x = 0; x < packed.width; ++x) {
      const float alpha = 0.5f * static_cast<float>(x / 4), color = alpha * (y < 4 ? 2.f : lower);
      packed.texels.push_back(
          {image::nearestHalf(color), image::nearestHalf(color / 4), 0, image::nearestHalf(alpha)});
    }
  return packed;
}

TEST(ViewBlocks, ReturnTheirTexels) {
  const PackedViews packed = threeAlphas(0.5f), blocks = withBlocks(packed);
  EXPECT_EQ(blocks.bytes(), packed.bytes() / 8);
  EXPECT_EQ(blocks.views[0].white, 2);
  for (int y = 0; y < packed.height; ++y)
    for (int x = 0; x < packed.width; ++x) {
      const capture::Pixel pixel{x + 0.5, y + 0.5};
      const Eigen::Vector4d wanted = texelAt(packed, 0, pixel), found = texelAt(blocks, 0, pixel);
      EXPECT_NEAR(found[3], wanted[3], 0.5 / 255);
      for (Eigen::Index c = 0; c < 3; ++c) EXPECT_NEAR(found[c], wanted[c], 0.03);
    }
}

TEST(ViewBlocks, KeepTheirColourAtOutlines) {
  const PackedViews blocks = withBlocks(threeAlphas(2));
  for (const double x : {3.7, 4.0, 4.3, 7.8, 8.2}) {
    const Eigen::Vector4d color = texelAt(blocks, 0, {x, 1.5});
    EXPECT_GT(color[3], 0);
    EXPECT_NEAR(color[0] / color[3], 2, 0.03);
  }
}

// A highlight of one texel, and an outline of one nearly transparent one, neither of which may take the codes
// of all others.
TEST(ViewBlocks, OneBrightTexelDoesNotSetWhite) {
  for (const float alpha : {1.f, 0.25f}) {
    PackedViews packed;
    packed.width = packed.height = 16;
    packed.views.resize(1);
    packed.views[0].width = packed.views[0].height = 16;
    for (int i = 0; i < 256; ++i) {
      const float color = 0.5f + 0.4f * static_cast<float>(i % 16) / 15;
      packed.texels.push_back({image::nearestHalf(color), image::nearestHalf(0.6f * color),
                               image::nearestHalf(0.3f * color), image::nearestHalf(1)});
    }
    const float bright = 1000 * alpha;
    packed.texels[0] = {image::nearestHalf(bright), image::nearestHalf(bright), image::nearestHalf(bright),
                        image::nearestHalf(alpha)};
    const ViewBlocks stored = viewBlocks(packed.texels, 16, 16);
    EXPECT_LE(stored.white, 4 * 0.9f);
    EXPECT_EQ(stored.visible, 256u);
    EXPECT_EQ(stored.cutOff, 1u);
    const PackedViews blocks = withBlocks(packed);
    for (int y = 4; y < 16; ++y) // apart from the texel's block
      for (int x = 4; x < 16; ++x) {
        const capture::Pixel pixel{x + 0.5, y + 0.5};
        const Eigen::Vector4d wanted = texelAt(packed, 0, pixel), found = texelAt(blocks, 0, pixel);
        for (Eigen::Index c = 0; c < 3; ++c) EXPECT_NEAR(found[c], wanted[c], 0.06);
      }
  }
}

TEST(ViewBlocks, AreBlackWhereAllIsTransparent) {
  PackedViews packed;
  packed.width = packed.height = 5;
  packed.views.resize(2);
  for (PackedView& view : packed.views) view.width = view.height = 5;
  packed.texels.resize(50);
  const PackedViews blocks = withBlocks(packed);
  EXPECT_EQ(blocks.width, 8);
  EXPECT_EQ(blocks.views[1].white, 1);
  EXPECT_EQ(texelAt(blocks, 1, {2, 2}), Eigen::Vector4d(0, 0, 0, 0));
}

TEST_F(OpacityBuild, BlocksAreReadAsTheyWereBuilt) {
  lightfield::Views views(*shared_ / "capture");
  const BuildReport report =
      build(views, {.packing = {.budget = size_t{1} << 30, .s3tc = true}}, folder_ / "small");
  const OpacityField field = read(folder_ / "small"), whole = read(folder_.path());
  EXPECT_EQ(report.packedBytes, field.packed.blocks.size());
  EXPECT_TRUE(report.s3tc);
  EXPECT_TRUE(field.packed.texels.empty());
  const PackedViews again = withBlocks(whole.packed);
  EXPECT_EQ(field.packed.blocks, again.blocks);
  for (size_t view = 0; view < 30; ++view) EXPECT_EQ(field.packed.views[view].white, again.views[view].white);
  // The frame from a camera is near that of half floats.
  const image::Image small = referencePicture(field, ViewBlender(field), field.cameras[3]).color,
                     large = referencePicture(whole, ViewBlender(whole), field.cameras[3]).color;
  double squares = 0, peak = 0;
  for (size_t i = 0; i < small.values.size(); ++i) {
    squares += std::pow(static_cast<double>(small.values[i]) - static_cast<double>(large.values[i]), 2);
    peak = std::max(peak, static_cast<double>(large.values[i]));
  }
  EXPECT_GE(10 * std::log10(peak * peak * static_cast<double>(small.values.size()) / squares), 30);
}

TEST_F(OpacityBuild, AnOpacityHullHoldsTheSphere) {
  const lightfield::Views views(*shared_ / "capture");
  const TriangleMesh hull = opacityHull(views);
  const RayCaster<AcquisitionSpace> rays(hull);
  std::mt19937 random(10);
  for (int i = 0; i < 200; ++i) {
    const auto hit = rays.firstHit(Point3<AcquisitionSpace, double>(0, 0, 0),
                                   assume<Direction3<AcquisitionSpace, double>>(randomUnit(random)));
    ASSERT_TRUE(hit);
    EXPECT_GE(hit->distance, 1);
    EXPECT_LE(hit->distance, 1.5);
  }
}

TEST_F(OpacityBuild, WrongContentIsRefusedByItsPlace) {
  const OpacityField good = read(*shared_ / "field");
  const auto wrong = [&](const auto& change) {
    OpacityField field = good;
    change(field);
    return errorOf(field);
  };
  const std::string views = (folder_ / "views.bin").string(), texels = (folder_ / "texels.bin").string();
  EXPECT_EQ(wrong([](OpacityField& field) { field.packed.views[3].width = 1000; }),
            views + ": views[3].width: found 1000, expected 1.." + std::to_string(good.packed.width));
  EXPECT_EQ(wrong([](OpacityField& field) { field.packed.views[0].scale[1] = 0; }),
            views + ": views[0].scale[1]: found 0, expected 1e-09..1");
  EXPECT_NE(
      wrong([](OpacityField& field) { field.packed.views[0].low[0] = std::nan(""); }).find("views[0].low[0]"),
      std::string::npos);
  EXPECT_NE(wrong([](OpacityField& field) {
              field.visible.views[0] = 77;
            }).find("visibleViews[0]: found 77, expected 0..29"),
            std::string::npos);
  EXPECT_NE(wrong([](OpacityField& field) {
              std::swap(field.visible.views[0], field.visible.views[1]);
            }).find("views in rising order"),
            std::string::npos);
  EXPECT_NE(wrong([](OpacityField& field) { field.visible.first[1] = 1u << 30; }).find("first[1]"),
            std::string::npos);
  EXPECT_NE(wrong([](OpacityField& field) { field.visible.views.pop_back(); }).find("visibleViews"),
            std::string::npos);
  EXPECT_NE(wrong([](OpacityField& field) { field.visible.views.push_back(1); }).find("end"),
            std::string::npos);
  EXPECT_EQ(wrong([](OpacityField& field) { field.packed.texels[5][2] = 0x7c00; }),
            texels + ": texel 5: is not finite");
  EXPECT_NE(wrong([](OpacityField& field) { field.packed.texels.pop_back(); }).find("bytes, expected "),
            std::string::npos);
  const std::string blocks = (folder_ / "blocks.bin").string();
  const auto wrongBlocks = [&](const auto& change) {
    return wrong([&](OpacityField& field) {
      field.packed = withBlocks(field.packed);
      change(field.packed);
    });
  };
  EXPECT_EQ(wrongBlocks([](PackedViews& packed) { packed.views[2].white = 0; }),
            blocks + ": white[2]: found 0, expected a finite number of at least 1e-30");
  const auto bytes = [&](const OpacityField& field) {
    return field.packed.views.size() * sizeof(float) + field.packed.blocks.size();
  };
  OpacityField compressed = good;
  compressed.packed = withBlocks(good.packed);
  const std::string expected = " bytes, expected " + std::to_string(bytes(compressed)) + " bytes";
  EXPECT_EQ(wrongBlocks([](PackedViews& packed) { packed.blocks.pop_back(); }),
            blocks + ": found " + std::to_string(bytes(compressed) - 1) + expected);
  EXPECT_EQ(wrongBlocks([](PackedViews& packed) { packed.blocks.push_back(0); }),
            blocks + ": found " + std::to_string(bytes(compressed) + 1) + expected);
  EXPECT_EQ(wrongBlocks([](PackedViews& packed) { ++packed.width; }),
            (folder_ / "manifest.json").string() + ": numbers.width: found " +
                std::to_string(compressed.packed.width + 1) + ", expected a multiple of 4 for blocks");
}

} // namespace
} // namespace surflect::olf
