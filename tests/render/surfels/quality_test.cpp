// Visible artefacts: popping along a camera path, seams on smooth surfaces, holes in stretched ones.

#include "srf/capture/silhouette.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/render/films.h"
#include "warp/deform.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surflect::surfels {
namespace {

using V3 = Vec3<double>;
using studio::cameraFrom;
using studio::filmOf;

constexpr double kPi = std::numbers::pi;

// Viewpoint on a great circle from above the object, past the rig's cameras, to below it: `s` from 0 to 1.
V3 alongPath(double s) {
  const double elevation = (70 - 155 * s) * kPi / 180;
  return {std::cos(elevation) * 0.8, std::sin(elevation), std::cos(elevation) * 0.6};
}

// All training cameras are above the sphere's centre; no camera sees the lowest part.
studio::Studio halfSurrounded() {
  return {.cameras = 24, .lights = 12, .split = [](size_t view, size_t) {
            return view < 12 ? capture::Split::train : capture::Split::test;
          }};
}

double distance(Rgb a, Rgb b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

// Colour of each surfel's camera blend, seen from its own place on the path.
std::vector<Rgb> cameraBlend(const model::Model& model, std::span<const double> places) {
  weights::QueryBatch batch;
  batch.lights = model.rig.lights.empty() ? 0 : 1;
  for (uint32_t i = 0; i < places.size(); ++i) {
    const V3 eye = studio::cameraDistance * alongPath(places[i]);
    const V3 towards = (eye - model.cloud.p0[i].cast<double>().raw()).normalized();
    batch.surfels.push_back(i);
    batch.towardsView.push_back(assume<Direction3<AcquisitionSpace>>(towards));
    for (size_t l = 0; l < batch.lights; ++l) {
      batch.towardsLight.push_back({0, 1, 0});
      batch.irradiance.push_back({1, 1, 1});
    }
  }
  return shading::planShading(model, batch, {.showsBlends = true}).cameraBlend;
}

// For each surfel, the largest change of its blend over a step of the path, and the change that remains after
// the step has been halved several times, always towards the larger change. A jump keeps its size; a
// differentiable function keeps one part in 2^halvings.
struct Change {
  double overStep = 0, afterHalving = 0;
};
std::vector<Change> changesAlongPath(const model::Model& model, int steps, int halvings) {
  const size_t n = model.cloud.size();
  std::vector<Change> changes(n);
  std::vector<double> from(n), places(n, 0.0);
  std::vector<Rgb> before = cameraBlend(model, places);
  for (int step = 1; step <= steps; ++step) {
    std::ranges::fill(places, 1.0 * step / steps);
    const auto now = cameraBlend(model, places);
    for (size_t i = 0; i < n; ++i)
      if (const double change = distance(before[i], now[i]); change > changes[i].overStep)
        changes[i].overStep = changes[i].afterHalving = change, from[i] = (step - 1.0) / steps;
    before = now;
  }
  double length = 1.0 / steps;
  for (int halving = 0; halving < halvings; ++halving) {
    length /= 2;
    const auto at = [&](double offset) {
      for (size_t i = 0; i < n; ++i) places[i] = from[i] + offset;
      return cameraBlend(model, places);
    };
    const auto begin = at(0), middle = at(length), end = at(2 * length);
    for (size_t i = 0; i < n; ++i) {
      const double first = distance(begin[i], middle[i]), second = distance(middle[i], end[i]);
      changes[i].afterHalving = std::max(first, second);
      if (second > first) from[i] += length;
    }
  }
  return changes;
}

TEST(Quality, NoSurfelPopsOnTheWayOutOfTheCapturedViews) {
  const studio::PackedStudio packed(halfSurrounded(), 2000);
  size_t moving = 0, popping = 0;
  for (const Change& change : changesAlongPath(packed.model, 64, 6)) {
    moving += change.overStep > 0.05;
    popping += change.afterHalving > std::max(0.25 * change.overStep, 1e-3);
  }
  EXPECT_GT(moving, packed.model.cloud.size() / 4);
  EXPECT_EQ(popping, 0u);
}

TEST(Quality, PicturesBeyondTheCapturedViewsStayWithinWhatWasPhotographed) {
  studio::Studio studio = halfSurrounded();
  studio.lights = 0; // fixed illumination whose radiance is nowhere black
  const studio::PackedStudio packed(studio, 2000);
  // Range of the radiance that the upper cameras see, with a margin for compression.
  const Rgb darkest = 0.95f * studio::fixedRadiance({0, -1, 0}),
            brightest = 1.03f * studio::fixedRadiance({0, 1, 0});
  size_t unseen = 0;
  for (int frame = 0; frame <= 12; ++frame) {
    surfels::FrameWorkspace workspace(packed.model, size_t{1} << 28);
    const auto camera = cameraFrom<ObjectSpace>(alongPath(frame / 12.0), 64);
    const image::Image color =
        surfels::renderFrame(packed.model, {*warp::chainWarp({}), camera, {}}, {}, workspace).color;
    unseen += workspace.stats.unseen;
    const image::Mask interior = image::eroded(image::objectMask(studio::viewSphere(camera, 3).alpha), 2);
    for (size_t i = 0; i < interior.inside.size(); ++i) {
      if (!interior.inside[i]) continue;
      const float* pixel = &color.values[4 * i];
      EXPECT_TRUE(pixel[0] >= darkest.r && pixel[0] <= brightest.r) << frame << ": " << pixel[0];
      EXPECT_TRUE(pixel[1] >= darkest.g && pixel[1] <= brightest.g) << frame << ": " << pixel[1];
      EXPECT_TRUE(pixel[2] >= darkest.b && pixel[2] <= brightest.b) << frame << ": " << pixel[2];
    }
  }
  EXPECT_GT(unseen, 100u);
}

// Largest difference between neighbouring pixels well inside the sphere.
double largestJump(const image::Image& image, const image::Mask& interior) {
  double largest = 0;
  const auto at = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
  };
  for (int y = 1; y < image.height; ++y)
    for (int x = 1; x < image.width; ++x)
      for (const size_t other : {at(x - 1, y), at(x, y - 1)}) {
        if (!interior.inside[at(x, y)] || !interior.inside[other]) continue;
        for (size_t c = 0; c < 3; ++c)
          largest =
              std::max(largest, 1.0 * std::abs(image.values[3 * at(x, y) + c] - image.values[3 * other + c]));
      }
  return largest;
}

TEST(Quality, BlendingFieldsHaveNoSeams) {
  const image::TemporaryFolder folder;
  const capture::Capture capture = studio::photograph(halfSurrounded(), folder / "capture");
  FrameOptions options;
  options.aovs = {"camera_blend", "light_blend"};
  const std::vector<scene::ShotLight> lights{scene::ShotPointLight{{1.5, 1.0, 1.2}, {5, 5, 5}}};
  studio::writeSphereMesh(folder / "smooth.ply", 512); // normals jump from face to face
  // Largest jumps by field and place on the path, for surfels and pixels finer by a factor.
  std::map<std::pair<std::string, int>, std::map<int, double>> jumps;
  for (const int fineness : {1, 4}) {
    const auto path = folder / std::to_string(fineness);
    model::PackOptions packOptions = studio::packOptions(static_cast<size_t>(2000 * fineness * fineness));
    packOptions.impostor.mesh = folder / "smooth.ply";
    model::pack(capture, path, packOptions, {}, nullptr);
    const model::Model model = model::openModel(path);
    for (int place = 0; place < 5; ++place) {
      const auto camera = cameraFrom<ObjectSpace>(alongPath(place / 4.0), 50 * fineness);
      const image::Mask interior =
          image::eroded(image::objectMask(studio::viewSphere(camera, 3).alpha), 3 * fineness);
      const FrameLayers film = filmOf(model, *warp::chainWarp({}), camera, lights, options);
      for (const auto& [name, field] : film.aovs)
        jumps[{name, place}][fineness] = largestJump(field, interior);
    }
  }
  // A seam keeps its height when surfels and pixels get finer. A hand-over between cameras within a few
  // degrees does not, though a coarse cloud shows both alike.
  for (const auto& [where, ofFineness] : jumps)
    EXPECT_LT(ofFineness.at(4), 0.7 * ofFineness.at(1)) << where.first << " at place " << where.second;
}

struct Deformation {
  const char* name;
  warp::WarpPointer warp;
};

TEST(Quality, AStretchedSurfaceStaysClosed) {
  const image::TemporaryFolder folder;
  studio::writeSphereMesh(folder / "sphere.ply", 384);
  const TriangleMesh mesh = readMesh(folder / "sphere.ply");
  const SurfelCloud cloud = sampleSurfels(mesh, spacingFor(mesh, 5000)); // two pixels apart at rest
  std::vector<Deformation> deformations;
  deformations.push_back({"1:4", warp::scaleWarp({1, 4, 1}, {0, 0, 0})});
  deformations.push_back({"1:8", warp::scaleWarp({1, 8, 1}, {0, 0, 0})});
  deformations.push_back({"1:4:8", warp::scaleWarp({0.5, 4, 2}, {0, 0, 0})});
  deformations.push_back({"squeezed", warp::scaleWarp({1, 0.125, 1}, {0, 0, 0})});
  deformations.push_back({"bend", warp::bendWarp({0, 1, 0}, {1, 0, 0}, Angle::fromDegrees(50), {0, 0, 0})});
  const auto formula = [](const char* text) { return warp::Expression(text, warp::warpVariables); };
  deformations.push_back({"shear", warp::expressionWarp(formula("x + 4*y"), formula("y"), formula("z"), {})});
  deformations.push_back({"twist", warp::twistWarp({0, 1, 0}, Angle::fromDegrees(150), {0, 0, 0})});
  for (const auto& [name, warp] : deformations) {
    const DeformedCloud deformed = warp::deform(cloud, *warp);
    const Mesh<ObjectSpace> bent = warp::deform(mesh, *warp);
    Eigen::AlignedBox3d box;
    for (const auto& p : bent.positions) box.extend(p.cast<double>().raw());
    const RayCaster<ObjectSpace> caster(bent);
    for (const V3& from : {V3(0, 0, 1), V3(1, 0.3, 0.5), V3(-0.8, -0.5, 0.6), V3(0.1, 1, 0.2)}) {
      auto camera = cameraFrom<ObjectSpace>(from, 160);
      camera.lens.focalX = camera.lens.focalY = 280;
      const double distance = 3 * box.diagonal().norm() / 2;
      camera.cameraFromWorld = {camera.cameraFromWorld.rotation(),
                                -(camera.cameraFromWorld.rotation() * box.center()) - V3(0, 0, distance)};
      const splat::SplatRaster coverage = look(camera, cloud, deformed);
      const image::Mask truth = image::objectMask(capture::silhouette(camera, caster));
      const image::Mask interior = image::eroded(truth, 2);
      image::Image alpha(coverage.width, coverage.height, 1);
      alpha.values = coverage.alpha;
      double least = 1;
      for (size_t i = 0; i < interior.inside.size(); ++i)
        if (interior.inside[i]) least = std::min(least, 1.0 * alpha.values[i]);
      EXPECT_GE(least, 0.999) << name << " from " << from.transpose();
      EXPECT_GE(image::intersectionOverUnion(truth, image::objectMask(alpha)), 0.98)
          << name << " from " << from.transpose();
    }
  }
}

TEST(Quality, StretchOfAPulledSphereIsThatOfItsTangentPlanes) {
  const studio::PackedStudio packed({.cameras = 6, .lights = 4}, 4000);
  FrameOptions options;
  options.aovs = {"stretch", "depth"};
  const std::vector<scene::ShotLight> lights{scene::ShotPointLight{{3, 3, 3}, {5, 5, 5}}};
  for (const double factor : {0.125, 0.25, 4.0, 8.0}) {
    auto camera = cameraFrom<ObjectSpace>({0.2, 0.3, 1}, 100);
    camera.lens.focalX = camera.lens.focalY = 100 / std::max(1.0, factor / 2);
    const FrameLayers film =
        filmOf(packed.model, *warp::scaleWarp({1, factor, 1}, {0, 0, 0}), camera, lights, options);
    const image::Mask interior = image::eroded(image::objectMask(film.color), 3);
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    double sum = 0, worst = 0;
    size_t pixels = 0;
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x) {
        if (!interior.inside[static_cast<size_t>(100 * y + x)]) continue;
        const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        const double along = film.aovs.at("depth").at(x, y)[0] / -ray->direction.z();
        V3 n = worldFromCamera(ray->origin + along * ray->direction).raw();
        n[1] /= factor; // position and normal at rest
        n.normalize();
        // The tangent along y x n keeps its length; the perpendicular one is the longest or shortest.
        const double other = std::sqrt(factor * factor * (1 - n[1] * n[1]) + n[1] * n[1]);
        const double expected = std::max(other, 1 / other);
        const double error = std::abs(film.aovs.at("stretch").at(x, y)[0] / expected - 1);
        sum += error, worst = std::max(worst, error);
        ++pixels;
      }
    // Normals of flat faces are up to 1.9 degrees off.
    EXPECT_LT(sum / static_cast<double>(pixels), 0.01) << factor;
    EXPECT_LT(worst, 0.06) << factor;
    EXPECT_GT(pixels, 200u) << factor;
  }
}

} // namespace
} // namespace surflect::surfels
