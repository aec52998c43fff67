#include "render/surfels/frame.h"

#include "render/scene/script.h"
#include "render/surfels/aovs.h"
#include "render/surfels/patch_corners.h"
#include "render/surfels/queries.h"
#include "warp/deform.h"

#include "render/evaluation/measure.h"
#include "tests/render/films.h"
#include "tests/support/given_up.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <random>
#include <utility>

namespace surflect::surfels {
namespace {

using studio::cameraFrom;
using studio::filmOf;
using studio::interiorOf;
using studio::largestDifference;
using studio::noWarp;
using studio::PackedStudio;
using studio::pictureSize;
using studio::Studio;
using studio::viewSphere;

scene::ShotPointLight pointLight(const Vec3<double>& position, Rgb intensity) {
  return {assume<Point3<ObjectSpace, double>>(position), intensity};
}

// Lambert sphere under a point light: A / pi  I / d^2  max(0, n . l).
image::Image sphereUnder(const scene::ShotPointLight& light, Rgb albedo, const studio::SphereView& view) {
  const Vec3<float> position = light.position.raw().cast<float>();
  return overBlack(view, [&](const Vec3<float>& n) {
    const Vec3<float> toLight = position - n;
    const float squared = toLight.squaredNorm();
    return studio::lambert(albedo, 1 / squared * light.intensity, n, toLight / std::sqrt(squared));
  });
}

TEST(Frame, LambertSphereUnderAMovingPointLightEqualsItsClosedForm) {
  const Studio studio{.lights = 200, .size = pictureSize};
  const PackedStudio packed(studio, 3000);
  FrameWorkspace workspace(packed.model, size_t{1} << 28);

  // Side, front and back light, 1.2 to 2.7 above the surface, seen from novel viewpoints.
  std::vector<image::Image> truths, films;
  std::vector<image::Mask> interiors;
  std::vector<float> values;
  for (int i = 0; i < 4; ++i) {
    const auto camera = cameraFrom<ObjectSpace>(studio::spiral(9)[2 * i + 1], pictureSize);
    const Vec3<double> fromCamera(1.5 * std::cos(1.9 * i), 1.5 * std::sin(1.9 * i), i == 3 ? -1.5 : 1.5);
    const Vec3<double> towards = camera.cameraFromWorld.rotation().transpose() * fromCamera.normalized();
    const scene::ShotPointLight light = pointLight((2.2 + 0.5 * i) * towards, {10, 8, 6});
    const studio::SphereView view = viewSphere(camera, 5);
    truths.push_back(sphereUnder(light, studio.albedo, view));
    interiors.push_back(interiorOf(view));
    const std::vector<scene::ShotLight> lamp{light};
    films.push_back(renderFrame(packed.model, {*noWarp(), camera, lamp}, {}, workspace).color);
    for (size_t k = 0; k < truths[i].values.size(); ++k)
      if (k % 4 < 3 && truths[i].values[k - k % 4 + 3] > 0.5f) values.push_back(truths[i].values[k]);
  }
  const auto white = values.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(values.size()));
  std::ranges::nth_element(values, white);
  evaluation::PooledMean interior;
  evaluation::Difference whole;
  for (int i = 0; i < 4; ++i) {
    interior += evaluation::squaredError(evaluation::applyExposure(truths[i], 1 / *white),
                                         evaluation::applyExposure(films[i], 1 / *white), interiors[i]);
    whole += evaluation::compare(truths[i], films[i], 1 / *white);
  }
  // PSNR with 40, 100, 200, 400, 800 lights: 33.8, 41.0, 43.7, 46.4, 50.5 dB. On the whole mask 38.7: every
  // seventh pixel of a sphere 30 pixels wide lies on the outline, where splats and truth are filtered
  // differently.
  EXPECT_GT(evaluation::psnr(interior.mean()), 43);
  EXPECT_GT(whole.psnrLinear(), 38);
}

TEST(Frame, LambertSphereUnderAConstantEnvironmentOfOneIsItsAlbedo) {
  const Studio studio{.lights = 80, .size = pictureSize};
  const PackedStudio packed(studio, 1500);
  constexpr int directions = 300;
  std::vector<scene::ShotLight> environment; // radiance 1: irradiance d omega from each direction
  const auto solidAngle = static_cast<float>(4 * std::numbers::pi / directions);
  for (const Vec3<double>& towards : studio::spiral(directions))
    environment.push_back(scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(towards),
                                                      {solidAngle, solidAngle, solidAngle}});
  const auto camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3}, pictureSize);
  studio::expectAlbedo(filmOf(packed.model, *noWarp(), camera, environment).color, camera, studio.albedo);
}

class FrameOfSphere : public studio::PackedSphere<2000> {
protected:
  const std::vector<scene::ShotLight> lights{pointLight({2, 1, 2}, {9, 8, 7}),
                                             pointLight({-3, 2, 0}, {1, 9, 20})};
};

TEST_F(FrameOfSphere, OneRigidMotionOfEverythingLeavesTheImageUnchanged) {
  const image::Image still = filmOf(model(), *noWarp(), camera, lights).color;
  std::mt19937 random(1);
  for (int trial = 0; trial < 3; ++trial) {
    const studio::RigidMotion motion = studio::randomMotion(random);
    auto movedLights = lights;
    for (scene::ShotLight& light : movedLights) {
      auto& point = std::get<scene::ShotPointLight>(light);
      point.position = motion.rigid()(point.position);
    }
    const image::Image moved = filmOf(model(), *motion.warp(), motion(camera), movedLights).color;
    EXPECT_LT(largestDifference(moved, still), 2.8e-6);
  }
}

TEST_F(FrameOfSphere, AMirroredWorldGivesTheMirroredImage) {
  const image::Image still = filmOf(model(), *noWarp(), camera, lights).color;
  auto mirroredLights = lights;
  for (scene::ShotLight& light : mirroredLights) {
    auto& point = std::get<scene::ShotPointLight>(light);
    point.position = assume<Point3<ObjectSpace, double>>(studio::mirror * point.position.raw());
  }
  const auto warp = warp::scaleWarp({-1, 1, 1}, Vec3<double>::Zero());
  const image::Image mirrored = filmOf(model(), *warp, studio::mirrored(camera), mirroredLights).color;
  // Footprints are evaluated relative to the middle of their tile, up to 20 standard deviations away, and
  // mirrored positions round differently: by 20 * 2^-24 of a deviation, twice.
  EXPECT_LT(largestDifference(studio::flipped(mirrored), still), 2.4e-6);
}

TEST_F(FrameOfSphere, TheIdentityHoweverItIsWrittenChangesNothing) {
  const image::Image still = filmOf(model(), *noWarp(), camera, lights).color;
  EXPECT_EQ(filmOf(model(), *warp::scaleWarp({1, 1, 1}, {0, 0, 0}), camera, lights).color.values,
            still.values);
  const Vec3<double> axis(0.6, 0, 0.8);
  std::vector<warp::WarpPointer> thereAndBack;
  thereAndBack.push_back(warp::twistWarp(axis, Angle::fromDegrees(100), {0.1, 0.2, 0.3}));
  thereAndBack.push_back(warp::twistWarp(axis, Angle::fromDegrees(-100), {0.1, 0.2, 0.3}));
  const image::Image back = filmOf(model(), *warp::chainWarp(std::move(thereAndBack)), camera, lights).color;
  EXPECT_LT(largestDifference(back, still), 1e-6);
}

TEST_F(FrameOfSphere, AUniformScaleSeenFromAsMuchFurtherChangesNothing) {
  const std::vector<scene::ShotLight> sun{scene::ShotDirectionalLight{{0.6, 0, 0.8}, {3, 3, 3}}};
  auto further = camera;
  further.cameraFromWorld = {camera.cameraFromWorld.rotation(), 3 * camera.cameraFromWorld.translation()};
  const image::Image still = filmOf(model(), *noWarp(), camera, sun).color;
  const image::Image scaled = filmOf(model(), *warp::scaleWarp({3, 3, 3}, {0, 0, 0}), further, sun).color;
  EXPECT_LT(largestDifference(scaled, still), 1.4e-6);
}

TEST_F(FrameOfSphere, SameBitsForAnyThreadsAnyCacheAndAnyPieces) {
  const auto warp = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(40), {0, 0, 0});
  FrameOptions options;
  options.aovs.assign(scene::aovNames.begin(), scene::aovNames.end());
  for (const size_t surfelsPerQuery : {1, 8}) {
    options.surfelsPerQuery = surfelsPerQuery;
    options.shade.targetsAtOnce = weights::kTargetsAtOnce;
    const FrameLayers expected = filmOf(model(), *warp, camera, lights, options);
    for (const int threads : {1, 2})
      for (const auto& [cacheBytes, targets] : {std::pair<size_t, size_t>{0, 700},
                                                {size_t{1} << 28, 33},
                                                {size_t{1} << 28, weights::kTargetsAtOnce}})
        tbb::task_arena(threads).execute([&, cacheBytes = cacheBytes, targets = targets] {
          FrameWorkspace workspace(model(), cacheBytes);
          options.shade.targetsAtOnce = targets;
          const FrameLayers film = renderFrame(model(), {*warp, camera, lights}, options, workspace);
          EXPECT_EQ(film.color.values, expected.color.values);
          for (const auto& [name, image] : expected.aovs)
            EXPECT_EQ(film.aovs.at(name).values, image.values) << name;
        });
  }
}

// Weights of neighbours differ by the size of a patch over the distance of the captured views.
TEST_F(FrameOfSphere, PatchesShowTheFullFrameUpToTheirSize) {
  const auto warp = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(40), {0, 0, 0});
  const image::Image full = filmOf(model(), *warp, camera, lights).color;
  FrameOptions options;
  FrameWorkspace workspace(model(), size_t{1} << 28);
  const auto pictureWith = [&](size_t most) {
    options.surfelsPerQuery = most;
    return renderFrame(model(), {*warp, camera, lights}, options, workspace).color;
  };
  for (const auto& [most, leastDb] : {std::pair<size_t, double>{2, 52}, {8, 46}, {32, 39}})
    EXPECT_GT(evaluation::compare(full, pictureWith(most), 1 / 3.0).psnrLinear(), leastDb) << most;
  EXPECT_EQ(pictureWith(1).values, full.values);
}

// A glossy sphere whose patches have many surfels, so that weights are blended over their corners.
class FrameOfDenseSphere : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    packed = std::make_unique<PackedStudio>(Studio{.cameras = 14, .lights = 9, .gloss = 0.3f}, 40'000);
  }
  static void TearDownTestSuite() { packed.reset(); }

  static inline std::unique_ptr<PackedStudio> packed;
  const model::Model& model() { return packed->model; }
  capture::Camera<ObjectSpace> camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3}, 2 * pictureSize);
  std::unique_ptr<const warp::Warp> warp = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(40), {0, 0, 0});
  std::vector<scene::ShotLight> lights{pointLight({3, 2, 1}, {20, 16, 12}),
                                       scene::ShotDirectionalLight{{0.6, 0, 0.8}, {1, 2, 3}}};
  FrameOptions options = [] {
    FrameOptions own;
    own.shade.interpolation = weights::Interpolation::kriging;
    return own;
  }();
};

TEST_F(FrameOfDenseSphere, BlendedCornersShowTheFullFrame) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  const auto pictureWith = [&](std::optional<size_t> perQuery) {
    options.surfelsPerQuery = perQuery;
    return renderFrame(model(), {*warp, camera, lights}, options, workspace).color;
  };
  const image::Image full = pictureWith(1);
  const size_t surfels = workspace.stats.queries;
  for (const auto& [perQuery, leastDb] :
       {std::pair<std::optional<size_t>, double>{2, 68}, {std::nullopt, 64}, {16, 64}}) {
    EXPECT_GT(evaluation::compare(full, pictureWith(perQuery), 1 / 3.0).psnrLinear(), leastDb)
        << perQuery.value_or(0);
    EXPECT_LT(workspace.stats.queries, surfels);
  }
}

// A table of one highlight, smooth in the coordinates of tables, which all surfels share.
reflectance::SharedReflectance oneHighlight(size_t surfels, float white) {
  reflectance::SharedReflectance shared{.white = white, .trust = {1}};
  const reflectance::TableGrid& grid = shared.tables.grid;
  std::vector<Rgb> nodes(grid.size());
  const auto unstretched = [](uint32_t node, uint32_t count) {
    const double a = 2.0 * node / (count - 1) - 1;
    return a / (3 - 2 * std::abs(a));
  };
  for (uint32_t half = 0; half < grid.nodes[0] * grid.nodes[1]; ++half)
    for (uint32_t difference = 0; difference < grid.differences(); ++difference) {
      const double u = unstretched(half / grid.nodes[1], grid.nodes[0]),
                   v = unstretched(half % grid.nodes[1], grid.nodes[1]);
      const auto value = static_cast<float>(0.1 + 0.3 * std::exp(-(u * u + v * v) / 0.02));
      nodes[grid.indexOf(half, difference)] = {value, value, value};
    }
  shared.tables.add(nodes);
  shared.tilts.resize(surfels);
  shared.fibres.resize(surfels);
  shared.mixtures.resize(surfels);
  shared.gains.assign(surfels, {1, 1, 1});
  return shared;
}

// Weights that are linear between the corners of a patch of 16 surfels leave no seams: neighbours in two
// patches do not differ by more, beside what their own weights say, than neighbours in one patch.
TEST_F(FrameOfDenseSphere, BlendedCornersLeaveNoSeamsBetweenPatches) {
  model::Model own = model::openModel(packed->folder / "model");
  own.shared = oneHighlight(own.cloud.size(), static_cast<float>(own.white));
  own.interpolation.kind = weights::Interpolation::shared;
  own.interpolation.otherwise = weights::Interpolation::kriging;
  const DeformedCloud deformed = warp::deform(own.cloud, *warp);
  const std::vector<uint32_t> visible = look(camera, own.cloud, deformed).visible;
  const Patches patches = patchesOf(own.cloud, 16);
  const PatchCorners corners = patchCorners(own.cloud, patches, visible, {}, lights.size());
  const auto patchOf = [&](size_t place) {
    return std::ranges::upper_bound(patches.first, visible[place]) - patches.first.begin();
  };
  codec::BlockCache cache(own.files, size_t{1} << 28);
  shading::ShadingStats stats;
  // Largest RMS difference of the errors of neighbours, relative to white.
  for (const auto& [interpolation, bound] :
       {std::pair{weights::Interpolation::kriging, 2e-3}, {weights::Interpolation::shared, 9e-3}}) {
    options.shade.interpolation = interpolation;
    const auto shaded = [&](const weights::QueryBatch& batch) {
      return shading::shade(own, batch, options.shade, cache, stats).radiance;
    };
    weights::QueryBatch atCorners = queriesAt(own.cloud, deformed, corners.surfels(visible), camera, lights);
    corners.addPlaces(visible, 0, corners.corners.size(), atCorners);
    const std::vector<Rgb> blended = shaded(atCorners),
                           exact = shaded(queriesAt(own.cloud, deformed, visible, camera, lights));
    const auto error = [&](size_t place) { return double{blended[place].g} - exact[place].g; };
    std::array<evaluation::PooledMean, 2> squares; // within a patch, and across a border
    for (size_t place = 0; place + 1 < visible.size(); ++place)
      if (visible[place + 1] == visible[place] + 1)
        squares[patchOf(place) != patchOf(place + 1)] +=
            {std::pow((error(place + 1) - error(place)) / own.white, 2), 1};
    const double within = std::sqrt(squares[0].mean()), across = std::sqrt(squares[1].mean());
    EXPECT_GT(squares[1].count, 300u);
    EXPECT_GT(across, 0);
    EXPECT_LT(across, 1.2 * within); // 0.8
    EXPECT_LT(across, bound);
  }
}

TEST_F(FrameOfDenseSphere, BlendedCornersHaveTheSameBitsForAnyThreadsAndPieces) {
  options.aovs = {"camera_blend", "light_blend"};
  for (const double surfelSize : {0.0, 1.5}) {
    options.surfelSize = surfelSize;
    options.shade.targetsAtOnce = weights::kTargetsAtOnce;
    const FrameLayers expected = filmOf(model(), *warp, camera, lights, options);
    for (const int threads : {1, 2})
      for (const size_t targets : {size_t{33}, size_t{700}})
        tbb::task_arena(threads).execute([&] {
          options.shade.targetsAtOnce = targets;
          const FrameLayers film = filmOf(model(), *warp, camera, lights, options);
          EXPECT_EQ(film.color.values, expected.color.values);
          for (const auto& [name, image] : expected.aovs)
            EXPECT_EQ(film.aovs.at(name).values, image.values) << name;
        });
  }
}

TEST_F(FrameOfDenseSphere, PredictingErrorsLeavesBlendedCornersAsTheyAre) {
  const FrameLayers plain = filmOf(model(), *warp, camera, lights, options);
  options.aovs = {"predicted_error"};
  EXPECT_EQ(filmOf(model(), *warp, camera, lights, options).color.values, plain.color.values);
}

// Earlier frames: a larger picture, another warp, a frame with nothing visible, and an interrupted one.
TEST_F(FrameOfSphere, TheWorkspaceOfOtherFramesChangesNothing) {
  constexpr size_t cacheBytes = size_t{1} << 28;
  FrameWorkspace used(model(), cacheBytes);
  const std::vector<std::string> all(scene::aovNames.begin(), scene::aovNames.end());
  const auto render = [&](const warp::Warp& warp, int size, FrameWorkspace& workspace,
                          const std::vector<std::string>& aovs, const Progress& progress = {}) {
    FrameOptions options;
    options.aovs = aovs;
    const auto picture = cameraFrom<ObjectSpace>({1, 0.4, 0.3}, size);
    return renderFrame(model(), {warp, picture, lights}, options, workspace, progress);
  };
  const auto expectSame = [](const FrameLayers& film, const FrameLayers& wanted) {
    EXPECT_EQ(film.color.values, wanted.color.values);
    ASSERT_EQ(film.aovs.size(), wanted.aovs.size());
    for (const auto& [name, image] : wanted.aovs) EXPECT_EQ(film.aovs.at(name).values, image.values) << name;
  };
  const warp::Expression x("x", warp::warpVariables), nan("sqrt(-1 - x^2)", warp::warpVariables);
  const auto still = noWarp(), flat = warp::scaleWarp({1, 1, 0.3}, Vec3<double>::Zero()),
             nowhere = warp::expressionWarp(nan, x, x, {});
  FrameWorkspace fresh(model(), cacheBytes);
  const FrameLayers expected = render(*noWarp(), pictureSize, fresh, {"normal", "light_blend"});
  for (const auto& [warp, size] :
       {std::pair{still.get(), pictureSize}, {flat.get(), 3 * pictureSize}, {nowhere.get(), 20}}) {
    FrameWorkspace other(model(), cacheBytes);
    FrameLayers film = render(*warp, size, used, all);
    expectSame(film, render(*warp, size, other, all));
    used.layers = std::move(film);
    expectSame(render(*noWarp(), pictureSize, used, {"normal", "light_blend"}), expected);
  }
  for (int calls = 0; calls < 200; calls += 7) {
    std::atomic<int> left = calls;
    Progress progress;
    progress.cancelled = [&] { return left-- <= 0; };
    try {
      used.layers = render(*flat, 2 * pictureSize, used, {"depth"}, progress);
    } catch (const Cancelled&) {
    }
    EXPECT_EQ(render(*noWarp(), pictureSize, used, {}).color.values, expected.color.values) << calls;
  }
}

TEST_F(FrameOfSphere, AFrameThatIsGivenUpAnywhereLeavesTheNextAsItIs) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  const auto still = noWarp();
  const scene::Scene scene{*still, camera, lights};
  const std::vector<float> expected = renderFrame(model(), scene, {}, workspace).color.values;
  FrameOptions all;
  all.aovs.assign(scene::aovNames.begin(), scene::aovNames.end());
  const size_t given = giveUpEverywhere(
      [&](const Progress& progress) {
        EXPECT_EQ(renderFrame(model(), scene, all, workspace, progress).color.values, expected);
      },
      [&] { EXPECT_EQ(renderFrame(model(), scene, {}, workspace).color.values, expected); });
  EXPECT_GE(given, 10u);
}

TEST_F(FrameOfSphere, AovsAskedForTogetherAreThoseAskedForAlone) {
  FrameOptions options;
  options.aovs.assign(scene::aovNames.begin(), scene::aovNames.end());
  const FrameLayers together = filmOf(model(), *noWarp(), camera, lights, options);
  for (const std::string_view name : scene::aovNames) {
    options.aovs = {std::string(name)};
    EXPECT_EQ(filmOf(model(), *noWarp(), camera, lights, options).aovs.at(options.aovs[0]).values,
              together.aovs.at(options.aovs[0]).values)
        << name;
  }
}

TEST_F(FrameOfSphere, PredictingErrorsLeavesTheColorAsItIs) {
  for (const weights::Interpolation kind : {weights::Interpolation::paper, weights::Interpolation::kriging}) {
    FrameOptions options;
    options.shade.interpolation = kind;
    const FrameLayers plain = filmOf(model(), *noWarp(), camera, lights, options);
    options.aovs = {"predicted_error"};
    const FrameLayers film = filmOf(model(), *noWarp(), camera, lights, options);
    EXPECT_EQ(film.color.values, plain.color.values);
    EXPECT_FALSE(plain.aovs.contains("predicted_error"));
    const std::vector<float>& error = film.aovs.at("predicted_error").values;
    for (size_t pixel = 0; pixel < error.size(); ++pixel) {
      if (film.color.values[4 * pixel + 3] == 1) {
        EXPECT_GT(error[pixel], 0);
      }
    }
  }
}

// The nearest photograph is the picture where nothing is blended: no photographs disagree.
TEST_F(FrameOfSphere, PredictedDisagreementIsNoneForTheNearestPhotographAlone) {
  FrameOptions options;
  options.aovs = {"predicted_error"};
  options.errorModel = {1, 0, 0};
  const image::Image blended = filmOf(model(), *noWarp(), camera, lights, options).aovs.at("predicted_error");
  EXPECT_GT(std::ranges::max(blended.values), 0.01f);
  options.shade.nearest = true;
  const image::Image alone = filmOf(model(), *noWarp(), camera, lights, options).aovs.at("predicted_error");
  EXPECT_EQ(std::ranges::max(alone.values), 0);
}

TEST_F(FrameOfSphere, NormalAndDepthAreThoseOfTheSphere) {
  FrameOptions options;
  options.aovs = {"normal", "depth"};
  const FrameLayers film = filmOf(model(), *noWarp(), camera, lights, options);
  const studio::SphereView view = viewSphere(camera, 1);
  const image::Mask interior = interiorOf(view);
  for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel) {
    const bool isEmpty = film.color.values[4 * pixel + 3] == 0;
    EXPECT_EQ(std::isinf(film.aovs.at("depth").values[pixel]), isEmpty);
    if (!interior.inside[pixel]) continue;
    const Vec3<float> truth = view.normals[view.first[pixel]];
    const Vec3<float> normal(&film.aovs.at("normal").values[3 * pixel]);
    EXPECT_LT((normal - truth).norm(), 0.05);
    const Vec3<double> position = truth.cast<double>();
    const double depth = -camera.cameraFromWorld(assume<Point3<ObjectSpace, double>>(position)).z();
    EXPECT_NEAR(film.aovs.at("depth").values[pixel], depth, 0.006);
  }
}

TEST_F(FrameOfSphere, PositionProjectsToItsPixelAndRestIsCarriedThereByTheWarp) {
  FrameOptions options;
  options.aovs = {"position", "rest", "depth"};
  const auto still = noWarp(), twist = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(60), {0, 0, 0});
  const float largestSplat = std::ranges::max(model().cloud.radius);
  for (const warp::Warp* warp : {still.get(), twist.get()}) {
    const FrameLayers film = filmOf(model(), *warp, camera, lights, options);
    size_t opaque = 0;
    for (int y = 0; y < film.color.height; ++y)
      for (int x = 0; x < film.color.width; ++x) {
        const float alpha = film.color.at(x, y)[3];
        const Vec3<float> position(film.aovs.at("position").at(x, y).data()),
            rest(film.aovs.at("rest").at(x, y).data());
        if (alpha == 0) {
          EXPECT_EQ(position, Vec3<float>::Zero());
          EXPECT_EQ(rest, Vec3<float>::Zero());
        }
        if (alpha != 1) continue;
        ++opaque;
        const auto place = assume<Point3<ObjectSpace, double>>(position);
        const std::optional<capture::Pixel> pixel = camera.project(place);
        ASSERT_TRUE(pixel);
        EXPECT_LT(std::hypot(pixel->x - x - 0.5, pixel->y - y - 0.5), 0.7);
        EXPECT_NEAR(-camera.cameraFromWorld(place).z(), film.aovs.at("depth").at(x, y)[0],
                    0.45 * largestSplat);
        EXPECT_LT((warp->position(rest.cast<double>()) - position.cast<double>()).norm(),
                  0.06 * largestSplat);
      }
    EXPECT_GT(opaque, 300u);
  }
}

TEST_F(FrameOfSphere, AtRestPositionIsRest) {
  FrameOptions options;
  options.aovs = {"position", "rest"};
  const FrameLayers film = filmOf(model(), *noWarp(), camera, lights, options);
  EXPECT_EQ(film.aovs.at("position").values, film.aovs.at("rest").values);
}

TEST_F(FrameOfSphere, TheNormalOfAMirroredSurfaceStillPointsOutwards) {
  FrameOptions options;
  options.aovs = {"normal"};
  const FrameLayers film = filmOf(model(), *warp::scaleWarp({1, 1, -1}, {0, 0, 0}), camera, lights, options);
  const studio::SphereView view = viewSphere(camera, 1);
  const image::Mask interior = interiorOf(view);
  for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel) {
    if (!interior.inside[pixel]) continue;
    const Vec3<float> normal(&film.aovs.at("normal").values[3 * pixel]);
    EXPECT_LT((normal - view.normals[view.first[pixel]]).norm(), 0.05);
  }
}

TEST_F(FrameOfSphere, ACapturedCameraIsBlendedAlone) {
  FrameOptions options;
  options.aovs = {"camera_blend"};
  std::vector<Vec3<float>> colors;
  for (const capture::View& captured : {model().rig.views[3], model().rig.views[8]}) {
    const auto& pose = captured.camera.cameraFromWorld;
    const capture::Camera<ObjectSpace> same{captured.camera.lens, {pose.rotation(), pose.translation()}};
    const FrameLayers film = filmOf(model(), *noWarp(), same, lights, options);
    const image::Mask interior = interiorOf(viewSphere(same, 1));
    std::optional<Vec3<float>> color;
    for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel) {
      if (!interior.inside[pixel]) continue;
      const Vec3<float> here(&film.aovs.at("camera_blend").values[3 * pixel]);
      if (!color) color = here;
      EXPECT_LT((here - *color).norm(), 8e-7);
    }
    colors.push_back(*color);
  }
  EXPECT_GT((colors[0] - colors[1]).norm(), 0.05);
}

TEST_F(FrameOfSphere, StretchIsThatOfTheWarp) {
  FrameOptions options;
  options.aovs = {"stretch"};
  const auto front = cameraFrom<ObjectSpace>({0, 0, 1}, pictureSize);
  const auto stretchAtCenter = [&](const Vec3<double>& factors) {
    const FrameLayers film = filmOf(model(), *warp::scaleWarp(factors, {0, 0, 0}), front, lights, options);
    return film.aovs.at("stretch").at(pictureSize / 2, pictureSize / 2)[0];
  };
  EXPECT_NEAR(stretchAtCenter({1, 1, 1}), 1, 1.2e-7);
  EXPECT_NEAR(stretchAtCenter({1.5, 1.5, 1.5}), 1, 1.2e-7);
  EXPECT_NEAR(stretchAtCenter({1, 2, 1}), 2, 0.0068);
}

TEST_F(FrameOfSphere, CountsAddUp) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  renderFrame(model(), {*noWarp(), camera, lights}, {}, workspace);
  const FrameStats& stats = workspace.stats;
  const splat::SplatCounts& n = stats.splats;
  EXPECT_EQ(n.drawn + n.dead + n.notFinite + n.backFacing + n.tooNear + n.outside, model().cloud.size());
  EXPECT_GT(stats.visible, 0u);
  EXPECT_LE(stats.visible, n.drawn);
  EXPECT_EQ(stats.unseen, 0u);
  EXPECT_LE(stats.shading.operations, 3 * stats.visible);
  EXPECT_EQ(stats.shading.lost, 0u);
}

TEST_F(FrameOfSphere, AWarpWithoutValuesLeavesAnEmptyFrame) {
  const warp::Expression x("x", warp::warpVariables), nan("sqrt(-1 - x^2)", warp::warpVariables);
  const FrameLayers film = filmOf(model(), *warp::expressionWarp(nan, x, x, {}), camera, lights);
  for (const float value : film.color.values) EXPECT_EQ(value, 0);
}

TEST_F(FrameOfSphere, ALightOnASurfelLeavesEveryPixelFinite) {
  for (const uint32_t surfel : {7u, 700u}) {
    const Vec3<double> p = model().cloud.p0[surfel].raw().cast<double>();
    const FrameLayers film =
        filmOf(model(), *noWarp(), camera, std::vector<scene::ShotLight>{pointLight(p, {5, 0, 5})});
    for (const float value : film.color.values) EXPECT_TRUE(std::isfinite(value));
  }
}

// ---------------------------------------------------------------------------------------------------------

TEST(Stretch, IsOneForSimilaritiesAndTheRatioOfAScale) {
  EXPECT_DOUBLE_EQ(stretchOf({3, 0, 0}, {0, 0, -3}), 1);
  EXPECT_DOUBLE_EQ(stretchOf({1, 0, 0}, {0, 2, 0}), 2);
  EXPECT_DOUBLE_EQ(stretchOf({0, 5, 0}, {0, 0, 1}), 5);
}

TEST(Stretch, OfAShear) {
  for (const double s : {0.1, 0.7, 2.0, 9.0})
    EXPECT_NEAR(stretchOf({1, 0, 0}, {s, 1, 0}) / ((s * s + 2 + s * std::sqrt(s * s + 4)) / 2), 1, 4.5e-16);
}

TEST(Stretch, IsTheRatioOfSingularValues) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> size(0.1, 3), angle(0, 7);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec2<double> singular(size(random), size(random));
    const Eigen::Matrix<double, 3, 2> tangents = randomRotation(random).leftCols<2>() *
                                                 singular.asDiagonal() *
                                                 Eigen::Rotation2Dd(angle(random)).toRotationMatrix();
    const double ratio = singular.maxCoeff() / singular.minCoeff();
    EXPECT_NEAR(stretchOf(tangents.col(0), tangents.col(1)) / ratio, 1, 7e-15);
  }
}

} // namespace
} // namespace surflect::surfels
