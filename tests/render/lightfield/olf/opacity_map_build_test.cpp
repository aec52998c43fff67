#include "render/lightfield/olf/opacity_map_build.h"

#include "render/lightfield/lfm/lfm_file.h"
#include "tests/render/lightfield/lfm/edge_places.h"
#include "tests/render/lightfield/olf/painted_field.h"
#include "tests/support/random.h"

#include <tbb/global_control.h>

#include <cmath>
#include <random>

namespace surflect::olf {
namespace {

using lfm::TrianglePlace;

constexpr int kTexels = 48;
constexpr MapBuildOptions kOptions{.samples = 5, .viewSize = 8};

// Paints each texel of a view.
void paint(OpacityField& field, const auto& texelOf) {
  const size_t texels = field.packed.texels.size() / field.packed.views.size();
  for (size_t i = 0; i < field.packed.texels.size(); ++i) {
    const std::array<float, 4> rgba = texelOf(i / texels);
    for (size_t c = 0; c < 4; ++c) field.packed.texels[i][c] = image::nearestHalf(rgba[c]);
  }
}

OpacityField sphereField(int views = 30) {
  return paintedField(lightfield::bumpySphere(0, 8), views, kTexels, Blending::vdtm);
}

OpacityMaps built(const OpacityField& field, const MapBuildOptions& options = kOptions) {
  MapBuildReport report;
  return mapsOf(field, lfm::Rings(field.mesh), options, report);
}

// Calls work(place, direction) for random places and directions above their triangles.
void forPlaces(const OpacityMaps& maps, const auto& work) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 0.5);
  for (int trial = 0; trial < 2000; ++trial) {
    const TrianglePlace place{random() % maps.maps.mesh.triangles.size(), number(random), number(random)};
    const Vec3<double> d = randomUnit(random);
    if (d.dot(areaVector(maps.maps.mesh, place.triangle)) > 0) work(place, assume<lfm::Direction>(d));
  }
}

TEST(OpacityMapBuild, OpaqueViewsOfOneColourHaveThatColourAndAlphaOne) {
  OpacityField field = sphereField();
  paint(field, [](size_t) { return std::array{0.1f, 2.f, 0.5f, 1.f}; });
  const OpacityMaps maps = built(field);
  EXPECT_NEAR(maps.white, 2, 2e-3);
  forPlaces(maps, [&](const TrianglePlace& place, const lfm::Direction& d) {
    const Eigen::Vector4d color = colorAt(maps, place, d, lfm::kMostTerms);
    EXPECT_LT((color - Eigen::Vector4d(0.1, 2, 0.5, 1)).cwiseAbs().maxCoeff(), 0.006);
  });
}

TEST(OpacityMapBuild, TransparentViewsHaveAlphaZeroAndNoTerms) {
  OpacityField field = sphereField();
  paint(field, [](size_t) { return std::array{0.f, 0.f, 0.f, 0.f}; });
  const OpacityMaps maps = built(field);
  EXPECT_EQ(maps.white, 1);
  EXPECT_TRUE(maps.maps.terms.empty());
  forPlaces(maps, [&](const TrianglePlace& place, const lfm::Direction& d) {
    EXPECT_TRUE(colorAt(maps, place, d, lfm::kMostTerms).isZero(0));
  });
}

// Views along a line, and one view alone: blends of what they show.
TEST(OpacityMapBuild, FewViewsBlendWhatTheyShow) {
  for (const int views : {1, 2, 5}) {
    OpacityField field = sphereField(views);
    field.cameras.clear();
    for (int i = 0; i < views; ++i)
      field.cameras.push_back(studio::cameraFrom<AcquisitionSpace>({1, 0, 0.3 * i}, kTexels));
    field.visible = {};
    field.visible.first.push_back(0);
    for (size_t v = 0; v < field.mesh.positions.size(); ++v) {
      for (uint32_t i = 0; i < static_cast<uint32_t>(views); ++i) field.visible.views.push_back(i);
      field.visible.first.push_back(static_cast<uint32_t>(field.visible.views.size()));
    }
    paint(field, [](size_t view) {
      const float alpha = 0.4f + 0.1f * static_cast<float>(view);
      return std::array{alpha, alpha, alpha, alpha};
    });
    const OpacityMaps maps = built(field);
    forPlaces(maps, [&](const TrianglePlace& place, const lfm::Direction& d) {
      const double alpha = colorAt(maps, place, d, lfm::kMostTerms)[3];
      EXPECT_GE(alpha, 0.4 - 0.05);
      EXPECT_LE(alpha, 0.4 + 0.1 * (views - 1) + 0.05);
    });
  }
}

TEST(OpacityMapBuild, AlphaIsWithinItsBoundsForEveryNumberOfTerms) {
  const OpacityMaps maps = built(sphereField());
  ASSERT_EQ(maps.maps.terms.size(), 3u);
  forPlaces(maps, [&](const TrianglePlace& place, const lfm::Direction& d) {
    for (size_t terms = 0; terms <= 3; ++terms) {
      const Eigen::Vector4d color = colorAt(maps, place, d, terms);
      EXPECT_GE(color.minCoeff(), 0);
      EXPECT_LE(color[3], 1);
    }
  });
}

TEST(OpacityMapBuild, IsContinuousAcrossEdgesForEveryNumberOfTerms) {
  const OpacityMaps maps = built(sphereField());
  std::mt19937 random(2);
  for (const auto& [a, b] : lfm::testing::edgePlaces(maps.maps.mesh, random)) {
    const auto d = assume<lfm::Direction>(randomUnit(random));
    for (size_t terms = 0; terms <= 3; ++terms)
      EXPECT_LT((colorAt(maps, a, d, terms) - colorAt(maps, b, d, terms)).norm(), 1e-9);
  }
}

TEST(OpacityMapBuild, TermsAreProgressive) {
  const OpacityField field = sphereField();
  const lfm::Rings rings(field.mesh);
  MapBuildReport report, one;
  MapBuildOptions options = kOptions;
  options.terms = 4;
  const OpacityMaps four = mapsOf(field, rings, options, report);
  for (size_t k = 1; k < report.errors.size(); ++k)
    EXPECT_LT(report.errors[k].rms(), 0.95 * report.errors[k - 1].rms());
  options.terms = 1;
  const OpacityMaps single = mapsOf(field, rings, options, one);
  EXPECT_EQ(single.maps.mean.maps.data, four.maps.mean.maps.data);
  EXPECT_NEAR(one.errors[1].rms(), report.errors[1].rms(), 1e-5);
  forPlaces(four, [&](const TrianglePlace& place, const lfm::Direction& d) {
    EXPECT_LT((colorAt(four, place, d, 1) - colorAt(single, place, d, 1)).norm(), 0.02);
  });
}

// Waves of the views along and across the sphere, which few terms cannot have exactly, against the nearest
// view.
TEST(OpacityMapBuild, FromTheDirectionOfAViewItsTexelIsShownNearly) {
  OpacityField field = sphereField(60);
  const auto alphaOf = [](size_t view) { return 0.5f + 0.4f * std::sin(static_cast<float>(view) / 15); };
  paint(field, [&](size_t view) { return std::array{0.5f * alphaOf(view), 0.25f, 0.125f, alphaOf(view)}; });
  MapBuildOptions options = kOptions;
  options.viewSize = 24;
  const OpacityMaps maps = built(field, options);
  double squares = 0, count = 0;
  for (uint32_t triangle = 0; triangle < field.mesh.triangles.size(); ++triangle)
    for (uint32_t view = 0; view < field.cameras.size(); ++view) {
      Vec3<double> middle = Vec3<double>::Zero();
      for (const uint32_t v : field.mesh.triangles[triangle])
        middle += field.mesh.positions[v].cast<double>().raw() / 3;
      const Vec3<double> d = (field.cameras[view].center().raw() - middle).normalized();
      if (d.dot(areaVector(field.mesh, triangle).normalized()) < 0.5) continue;
      const double alpha =
          colorAt(maps, {triangle, 1.0 / 3, 1.0 / 3}, assume<lfm::Direction>(d), lfm::kMostTerms)[3];
      squares += std::pow(alpha - static_cast<double>(alphaOf(view)), 2), ++count;
    }
  RecordProperty("rms", std::to_string(std::sqrt(squares / count)));
  EXPECT_LT(std::sqrt(squares / count), 0.06);
}

// A cushion, and views from above alone, whose opacity rises with their height. Where a view faces a triangle
// from below the horizon of one of its vertices, that triangle has the opacity of the view.
TEST(OpacityMapBuild, AtTheOutlineATriangleShowsTheViewsThatFaceIt) {
  TriangleMesh cushion = lightfield::bumpySphere(0, 12);
  for (auto& p : cushion.positions) p = {p.raw()[0], p.raw()[1], 0.35f * p.raw()[2]};
  OpacityField field = paintedField(std::move(cushion), 120, kTexels, Blending::vdtm);
  std::erase_if(field.cameras, [](const auto& camera) { return camera.center().raw()[2] < 0; });
  field.packed.views.resize(field.cameras.size());
  field.packed.texels.resize(field.cameras.size() * kTexels * kTexels);
  const auto views = static_cast<uint32_t>(field.cameras.size());
  field.visible = {};
  for (uint32_t v = 0; v <= field.mesh.positions.size(); ++v) field.visible.first.push_back(v * views);
  for (uint32_t i = 0; i < field.visible.first.back(); ++i) field.visible.views.push_back(i % views);
  const auto alphaOf = [&](size_t view) {
    return 0.1f + 0.8f * static_cast<float>(field.cameras[view].center().raw().normalized()[2]);
  };
  paint(field, [&](size_t view) { return std::array{0.f, alphaOf(view), 0.f, alphaOf(view)}; });
  const lfm::Rings rings(field.mesh);
  const OpacityMaps maps = built(field, {.samples = 5, .viewSize = 16});
  double squares = 0, count = 0;
  for (uint32_t triangle = 0; triangle < field.mesh.triangles.size(); ++triangle)
    for (uint32_t view = 0; view < views; ++view) {
      Vec3<double> middle = Vec3<double>::Zero();
      for (const uint32_t v : field.mesh.triangles[triangle])
        middle += field.mesh.positions[v].cast<double>().raw() / 3;
      const Vec3<double> d = (field.cameras[view].center().raw() - middle).normalized();
      const bool isBelow = std::ranges::any_of(field.mesh.triangles[triangle],
                                               [&](uint32_t v) { return d.dot(rings.frame(v).z) < 0; });
      if (!isBelow || !(d.dot(areaVector(field.mesh, triangle)) > 0)) continue;
      const double alpha =
          colorAt(maps, {triangle, 1.0 / 3, 1.0 / 3}, assume<lfm::Direction>(d), lfm::kMostTerms)[3];
      const double error = std::abs(alpha - static_cast<double>(alphaOf(view)));
      squares += error * error, ++count;
    }
  EXPECT_GT(count, 500);
  RecordProperty("rms", std::to_string(std::sqrt(squares / count)));
  EXPECT_LT(std::sqrt(squares / count), 0.065); // 0.093 with frames along normals
}

TEST(OpacityMapBuild, IsTheSameForAnyNumberOfThreads) {
  const OpacityField field = sphereField();
  const std::vector<std::byte> expected = lfm::mapsBytes(built(field).maps);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(lfm::mapsBytes(built(field).maps), expected);
}

TEST(OpacityMapBuild, CountsBytesOfAllFourChannels) {
  const OpacityField field = sphereField();
  MapBuildReport report;
  mapsOf(field, lfm::Rings(field.mesh), kOptions, report);
  EXPECT_EQ(report.resampledBytes, 4u * field.mesh.triangles.size() * 15 * 64);
}

TEST(OpacityMapBuild, OptionsOutOfRangeAreRefusedAndWorkIsCancelled) {
  const OpacityField field = sphereField(3);
  const lfm::Rings rings(field.mesh);
  MapBuildReport report;
  const auto errorWith = [&](const MapBuildOptions& options) {
    return image::errorOf([&] { mapsOf(field, rings, options, report); });
  };
  EXPECT_EQ(errorWith({.terms = 65, .samples = 5}), "terms: found 65, expected 0..64");
  EXPECT_NE(errorWith({.samples = 1}), "");
  EXPECT_NE(errorWith({.samples = 5, .viewSize = 1}), "");
  const Progress stop{.report = {}, .cancelled = [] { return true; }};
  EXPECT_THROW(mapsOf(field, rings, kOptions, report, stop), Cancelled);
}

} // namespace
} // namespace surflect::olf
