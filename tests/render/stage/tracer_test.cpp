#include "render/stage/tracer.h"
#include "tests/render/stage/stages.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace surflect::stage {
namespace {

TracedView trace(const std::vector<StageObject>& objects, const capture::Camera<AcquisitionSpace>& camera,
                 const std::vector<capture::Light>& lights, const TraceOptions& options) {
  return traceView(StageScene(objects), camera, 0, lights, options, {});
}

TraceOptions samples(int count, Transport transport = Transport::full) {
  TraceOptions options;
  options.samples = count;
  options.transport = transport;
  return options;
}

// The mean of a picture's pixel over the object.
Vec3<double> meanRadiance(const TracedView& view, size_t light) {
  Vec3<double> total = Vec3<double>::Zero();
  for (size_t i = 0; i < view.alpha.values.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      total[static_cast<int>(c)] += view.alpha.values[i] * view.radiance[light].values[3 * i + c];
  return total / sum(view.alpha);
}

// rho E max(0, n . l) / pi
TEST(Tracer, LambertSphereUnderTheSunIsTheCosine) {
  std::mt19937 random(1);
  const capture::Camera camera = setPlaces(unit(1, 2, 0.5), 10, 32, 16, capture::Lens::Model::orthographic);
  const auto objects = oneObject(sphere(StagePoint(0, 0, 0), 0.9, 512), material::Lambert{kAlbedo});
  for (const Transport transport : {Transport::local, Transport::full})
    for (int trial = 0; trial < 4; ++trial) {
      const StageDirection l = randomDirection(random);
      const TracedView view = trace(objects, camera, {sun(l)}, samples(64, transport));
      for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) {
          if (view.alpha.at(x, y)[0] < 1) continue;
          double expected = 0; // over the pixel, by the middles of 16 x 16 parts
          for (int i = 0; i < 256; ++i) {
            const double px = (x + (i % 16 + 0.5) / 16 - 16) / 16, py = -(y + (i / 16 + 0.5) / 16 - 16) / 16;
            const double pz = std::sqrt(0.81 - px * px - py * py);
            const auto n = camera.cameraFromWorld.inverse()(Direction3<CameraSpace, double>(px, py, pz));
            expected += std::max(0., dot(n, l)) / 0.9 * 3 / material::kPi / 256;
          }
          // Full transport may lose light where triangles see none of it but their normals do.
          const double tolerance = 0.004 + (transport == Transport::full ? 0.01 : 0);
          EXPECT_NEAR(view.radiance[0].at(x, y)[0], 0.8 * expected, tolerance) << x << ' ' << y;
        }
    }
}

TEST(Tracer, AlphaIsTheCoveredArea) {
  const capture::Camera camera = setPlaces(unit(1, 0, 0), 10, 33, 16, capture::Lens::Model::orthographic);
  const TracedView view = trace(oneObject(sphere(StagePoint(0, 0, 0), 0.9, 512), material::Lambert{}), camera,
                                {sun(unit(1, 0, 0))}, samples(256));
  EXPECT_NEAR(sum(view.alpha) / 256, material::kPi * 0.81, 2e-3);
  EXPECT_EQ(view.alpha.at(0, 0)[0], 0);
  EXPECT_EQ(view.alpha.at(16, 16)[0], 1);
}

// Over even light from n directions that fill the sphere, sum_i L_i = albedo of a Lambert surface.
TEST(Tracer, WhiteObjectVanishesUnderEvenLight) {
  std::vector<capture::Light> lights;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, phi = material::kPi * (3 - std::sqrt(5.0)) * i,
                 r = std::sqrt(1 - z * z);
    const auto strength = static_cast<float>(4 * material::kPi / count); // radiance 1 from everywhere
    lights.push_back(sun({r * std::cos(phi), r * std::sin(phi), z}, {strength, strength, strength}));
  }
  // Light goes from one block to the other and back, and none is lost.
  std::vector<StageObject> objects =
      oneObject(box({-0.6, 0, 0}, {0.5, 2, 2}, 1), material::Lambert{{1, 1, 1}});
  objects.push_back({box({0.6, 0, 0}, {0.5, 2, 2}, 1), material::Lambert{{1, 1, 1}}});
  const capture::Camera camera = setPlaces(unit(0.4, 1, 0.7), 6, 12, 20);
  const TracedView view = trace(objects, camera, lights, samples(256));
  Vec3<double> total = Vec3<double>::Zero();
  for (size_t i = 0; i < lights.size(); ++i) total += meanRadiance(view, i);
  EXPECT_NEAR(total[0], 1, 0.005);
}

TEST(Tracer, OneBounceIsTheFormFactor) {
  // Two squares that share an edge at right angles: F = 0.20004 [Howell 1982, C-14].
  const double F = 0.20004;
  const float rho = 0.5f;
  Surface floor = box({0.5, 0.5, -0.5}, {1, 1, 1}, 1), wall = box({-0.5, 0.5, 0.5}, {1, 1, 1}, 1);
  std::vector<StageObject> objects = oneObject(floor, material::Lambert{{rho, rho, rho}});
  objects.push_back({wall, material::Lambert{{1e-3f, 1e-3f, 1e-3f}}}); // sends nothing back
  // Along the wall from above: only the floor is lit.
  const std::vector<capture::Light> lights{sun(unit(1e-6, 0, 1), {1, 1, 1})};
  // Seen from the front, the wall fills the picture: pixels are the unit square y, z in 0..1.
  capture::Camera<AcquisitionSpace> camera =
      setPlaces(unit(1, 0, 0), 5, 16, 16, capture::Lens::Model::orthographic);
  camera.lens.centerX = 0;
  camera.lens.centerY = 16;
  const TracedView full = trace(objects, camera, lights, samples(1024));
  const TracedView local = trace(objects, camera, lights, samples(16, Transport::local));
  ASSERT_EQ(sum(full.alpha), 256);
  // E_wall = F B, B = rho E; the wall shows 1e-3 of it over pi.
  const double direct = sum(local.radiance[0]) / 768, all = sum(full.radiance[0]) / 768;
  EXPECT_NEAR((all - direct) * material::kPi / 1e-3, F * rho, 0.003);
}

TEST(Tracer, FullIsLocalOnAConvexBox) {
  std::mt19937 random(2);
  const auto objects = oneObject(box(StagePoint(0, 0, 0), {1, 2, 1.5}, 3), material::Lambert{kAlbedo});
  const std::vector<capture::Light> lights{sun(randomDirection(random)),
                                           sun(randomDirection(random)),
                                           sun(randomDirection(random)),
                                           {"bulb", "bulb", capture::PointLight{{3, 1, 2}, {9, 8, 7}}}};
  for (int trial = 0; trial < 3; ++trial) {
    const capture::Camera camera = setPlaces(randomDirection(random), 5, 24, 30);
    const TracedView full = trace(objects, camera, lights, samples(4)),
                     local = trace(objects, camera, lights, samples(4, Transport::local));
    for (size_t i = 0; i < lights.size(); ++i)
      EXPECT_EQ(full.radiance[i].values, local.radiance[i].values) << trial << ' ' << i;
    EXPECT_EQ(full.alpha.values, local.alpha.values);
  }
}

TEST(Tracer, ShadowsAreDarkInFullTransportOnly) {
  auto objects = oneObject(box({0, 0, -1}, {4, 4, 0.5}, 1), material::Lambert{{1e-6f, 1e-6f, 1e-6f}});
  objects.push_back({sphere({0, 0, 1}, 1, 64), material::Lambert{{0, 0, 0}}});
  const std::vector<capture::Light> lights{sun({0, 0, 1})};
  capture::Camera<AcquisitionSpace> camera = setPlaces(unit(1, 0, 0.2), 6, 1, 1000);
  camera.lens.centerY = -1000 * std::tan(0.15); // below the ball, on the floor in its shadow
  const TracedView full = trace(objects, camera, lights, samples(16)),
                   local = trace(objects, camera, lights, samples(16, Transport::local));
  EXPECT_EQ(full.alpha.values[0], 1);
  EXPECT_GT(local.radiance[0].values[0], 0);
  EXPECT_EQ(full.radiance[0].values[0], 0);
}

// A mirror shows the disc of a light, radiance E / (pi sin^2 radius); a plane one under a sun as wide as the
// camera's field shows E's share of it.
TEST(Tracer, MirrorsShowLightsOfAnExtent) {
  const auto objects =
      oneObject(box({0, 0, -0.5}, {4, 4, 1}, 1), material::Conductor{{1, 0.5f, 0.25f}, {1, 1, 1}, {0, 0}});
  TraceOptions options = samples(64);
  options.lightRadius = Angle::fromDegrees(5);
  const capture::Camera camera = setPlaces(unit(1, 0, 1), 5, 8, 2000);
  const TracedView view = trace(objects, camera, {sun(unit(-1, 0, 1)), sun(unit(-1, 0.3, 1))}, options);
  const double sine = std::sin(options.lightRadius.radians());
  const double schlick = std::pow(1 - std::sqrt(0.5), 5);
  EXPECT_NEAR(view.radiance[0].at(4, 4)[0], 3 / (material::kPi * sine * sine),
              1e-3 * 3 / (material::kPi * sine * sine));
  EXPECT_NEAR(view.radiance[0].at(4, 4)[1] / view.radiance[0].at(4, 4)[0], 0.5 + 0.5 * schlick, 0.01);
  EXPECT_EQ(view.radiance[1].at(4, 4)[0], 0);
}

TEST(Tracer, LambertSeesADiscAsAPoint) {
  // E is that of the disc's middle as long as the disc is above the horizon.
  const auto objects = oneObject(box({0, 0, -0.5}, {40, 40, 1}, 1), material::Lambert{{1, 1, 1}});
  const capture::Camera camera = setPlaces(unit(1, 0, 1), 5, 4, 400);
  TraceOptions options = samples(4096);
  for (const double degrees : {0.0, 10.0, 30.0}) {
    options.lightRadius = Angle::fromDegrees(degrees);
    const TracedView view = trace(objects, camera, {sun(unit(0.5, 0.2, 1))}, options);
    EXPECT_NEAR(meanRadiance(view, 0)[0], 3 / material::kPi * unit(0.5, 0.2, 1).z(), 2e-3) << degrees;
  }
}

TEST(Tracer, AnUnevenSunIsStrongerHereThanThere) {
  const auto objects = oneObject(box({0, 0, -0.5}, {40, 40, 1}, 1), material::Lambert{{1, 1, 1}});
  const capture::Camera camera = setPlaces(unit(1, 0, 1), 5, 4, 10);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  TraceOptions options = samples(4096);
  capture::Light light = sun(unit(0.5, 0.2, 1));
  const Vec3<double> gradient(0.3, -0.2, 0.5);
  std::get<capture::DirectionalLight>(light.kind).irradianceGradient = gradient;
  for (const double degrees : {0.0, 10.0}) {
    options.lightRadius = Angle::fromDegrees(degrees);
    const TracedView view = trace(objects, camera, {light}, options);
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x) {
        double gain = 0; // over the pixel, by the middles of 8 x 8 parts
        for (int i = 0; i < 64; ++i) {
          const auto ray = capture::rayThrough(camera.lens, {x + (i % 8 + 0.5) / 8, y + (i / 8 + 0.5) / 8});
          const Vec3<double> o = worldFromCamera(ray->origin).raw(),
                             d = worldFromCamera(ray->direction).raw();
          gain += std::exp(gradient.dot(o - o.z() / d.z() * d)) / 64;
        }
        const double expected = gain * 3 / material::kPi * unit(0.5, 0.2, 1).z();
        EXPECT_NEAR(view.radiance[0].at(x, y)[0] / expected, 1, 2.8e-4);
      }
  }
}

// A clear slab at normal incidence passes 2 n / (n^2 + 1) of the light, summed over reflections inside.
TEST(Tracer, SlabOfGlassPassesWhatFresnelSays) {
  auto objects = oneObject(box({0, 0, 0}, {40, 40, 1}, 1), material::Dielectric{1.5, 0, {}});
  TraceOptions options = samples(4096);
  options.lightRadius = Angle::fromDegrees(1);
  capture::Camera<AcquisitionSpace> camera = setPlaces(unit(1e-9, 0, 1), 5, 1, 1000);
  const std::vector<capture::Light> below{sun({0, 0, -1})}, above{sun({0, 0, 1})};
  const double white = 3 / (material::kPi * material::squared(std::sin(options.lightRadius.radians())));
  const double passed = 2 * 1.5 / (1.5 * 1.5 + 1);
  EXPECT_NEAR(trace(objects, camera, below, options).radiance[0].values[0] / white, passed, 0.015);
  EXPECT_NEAR(trace(objects, camera, above, options).radiance[0].values[0] / white, 1 - passed, 0.015);
  // Absorption along each way through it: T (1-R)^2 / (1 - R^2 T^2).
  objects[0].material = material::Dielectric{1.5, 0, {0.7f, 0.7f, 0.7f}};
  const double R = 0.04, T = std::exp(-0.7);
  EXPECT_NEAR(trace(objects, camera, below, options).radiance[0].values[0] / white,
              T * material::squared(1 - R) / (1 - material::squared(R * T)), 0.015);
}

// Two such slabs, R and T by the one slab's series, pass T^2 / (1 - R^2): what lies between them is air.
TEST(Tracer, AbsorptionEndsWhereTheGlassDoes) {
  const material::Dielectric smoke{1.5, 0, {0.7f, 0.7f, 0.7f}};
  auto objects = oneObject(box({0, 0, 0}, {40, 40, 1}, 1), smoke);
  objects.push_back({box({0, 0, -4}, {40, 40, 1}, 1), smoke});
  TraceOptions options = samples(65536);
  options.lightRadius = Angle::fromDegrees(1);
  const capture::Camera camera = setPlaces(unit(1e-9, 0, 1), 5, 1, 1000);
  const double white = 3 / (material::kPi * material::squared(std::sin(options.lightRadius.radians())));
  const double r = 0.04, t = std::exp(-0.7), series = 1 - material::squared(r * t);
  const double passed = t * material::squared(1 - r) / series,
               reflected = r + r * material::squared(t * (1 - r)) / series;
  EXPECT_NEAR(trace(objects, camera, {sun({0, 0, -1})}, options).radiance[0].values[0] / white,
              material::squared(passed) / (1 - material::squared(reflected)), 0.005);
}

// A lamp in the middle of a hollow ball: each point gets E = I / r^2 from it, sum_k (rho E) rho^k leaves.
TEST(Tracer, IntegratingSphereAddsUpAllBounces) {
  const float rho = 0.8f;
  const auto objects = oneObject(sphere(StagePoint(0, 0, 0), 2, 256), material::Lambert{{rho, rho, rho / 2}});
  const std::vector<capture::Light> lamp{
      {"lamp", "lamp", capture::PointLight{StagePoint(0, 0, 0), {4, 4, 4}}}};
  const TracedView view = trace(objects, setPlaces(unit(1, 1, 0.3), 0.5, 16, 10), lamp, samples(64));
  ASSERT_EQ(sum(view.alpha), 256);
  EXPECT_NEAR(meanRadiance(view, 0)[0], rho / (material::kPi * (1 - rho)),
              0.01 * rho / (material::kPi * (1 - rho)));
  EXPECT_NEAR(meanRadiance(view, 0)[2], rho / 2 / (material::kPi * (1 - rho / 2)),
              0.01 * rho / 2 / (material::kPi * (1 - rho / 2)));
}

TEST(Tracer, ThreadsDoNotChangeABit) {
  auto objects = oneObject(bumpySphere(StagePoint(0, 0, 0), 0.8, 0.2, 6, 64), material::Lambert{kAlbedo});
  objects.push_back({box({0, 0, -1.2}, {3, 3, 0.2}, 1),
                     material::Ward{{0.4f, 0.4f, 0.4f}, {0.3f, 0.3f, 0.3f}, {0.1, 0.3}}});
  const capture::Camera camera = setPlaces(unit(1, 0.3, 0.6), 5, 40, 50);
  const std::vector<capture::Light> lights{sun(unit(1, 1, 1)), sun(unit(-1, 1, 2))};
  const TracedView many = trace(objects, camera, lights, samples(8));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const TracedView single = trace(objects, camera, lights, samples(8));
  EXPECT_EQ(many.radiance[0].values, single.radiance[0].values);
  EXPECT_EQ(many.radiance[1].values, single.radiance[1].values);
  EXPECT_EQ(many.alpha.values, single.alpha.values);
}

TEST(Tracer, LightsDoNotKnowOfEachOther) {
  const auto objects =
      oneObject(bumpySphere(StagePoint(0, 0, 0), 0.8, 0.2, 6, 64), material::Lambert{kAlbedo});
  const capture::Camera camera = setPlaces(unit(1, 0.3, 0.6), 5, 16, 20);
  const TracedView both = trace(objects, camera, {sun(unit(1, 1, 1)), sun(unit(-1, 1, 2))}, samples(8)),
                   second = trace(objects, camera, {sun(unit(-1, 1, 2))}, samples(8));
  EXPECT_EQ(both.radiance[1].values, second.radiance[0].values);
}

TEST(Tracer, SeedsAndViewsHaveTheirOwnNoise) {
  const auto objects =
      oneObject(bumpySphere(StagePoint(0, 0, 0), 0.8, 0.2, 6, 64), material::Lambert{kAlbedo});
  const StageScene scene(objects);
  const capture::Camera camera = setPlaces(unit(1, 0.3, 0.6), 5, 16, 20);
  const std::vector<capture::Light> lights{sun(unit(1, 1, 1))};
  TraceOptions options = samples(8);
  const auto first = traceView(scene, camera, 0, lights, options, {}).radiance[0].values;
  EXPECT_NE(first, traceView(scene, camera, 1, lights, options, {}).radiance[0].values);
  options.seed = 2;
  EXPECT_NE(first, traceView(scene, camera, 0, lights, options, {}).radiance[0].values);
}

// Object, camera and lights moved together: the same picture, but for rounding of vertices.
TEST(Tracer, MovingEverythingChangesNothing) {
  const Vec3<double> axis = Vec3<double>(1, 2, 3).normalized(), shift(5, -3, 2);
  const auto warp = warp::rigidWarp(axis, Angle::fromDegrees(70), {0, 0, 0}, shift);
  const Mat3<double> turn = Eigen::AngleAxisd(Angle::fromDegrees(70).radians(), axis).toRotationMatrix();
  const material::Ward brushed{{0.1f, 0.2f, 0.3f}, {0.5f, 0.5f, 0.5f}, {0.1, 0.5}};
  const Surface rest = bumpySphere(StagePoint(0, 0, 0), 0.8, 0.2, 6, 128);
  const capture::Camera camera = setPlaces(unit(1, 0.3, 0.6), 5, 24, 50);
  capture::Camera moved = camera;
  moved.cameraFromWorld = {camera.cameraFromWorld.rotation() * turn.transpose(),
                           camera.cameraFromWorld.translation() -
                               camera.cameraFromWorld.rotation() * (turn.transpose() * shift)};
  const StageDirection l = unit(1, 1, 1);
  for (const Transport transport : {Transport::local, Transport::full}) {
    const TracedView here = trace(oneObject(rest, brushed), camera, {sun(l)}, samples(64, transport)),
                     there = trace(oneObject(deformed(rest, *warp), brushed), moved,
                                   {sun(assume<StageDirection>(turn * l.raw()))}, samples(64, transport));
    const Vec3<double> a = meanRadiance(here, 0), b = meanRadiance(there, 0);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff() / a.maxCoeff(), 1e-3);
    double squares = 0;
    for (size_t i = 0; i < here.alpha.values.size(); ++i)
      squares += material::squared(here.radiance[0].values[3 * i] - there.radiance[0].values[3 * i]);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(here.alpha.values.size())) / a.maxCoeff(), 0.02);
  }
}

TEST(Tracer, CancelledWorkStops) {
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(traceView(StageScene(oneObject(sphere(StagePoint(0, 0, 0), 1, 8), material::Lambert{})),
                         setPlaces(unit(1, 0, 0), 5, 8, 8), 0, std::vector{sun(unit(1, 0, 0))}, {}, progress),
               Cancelled);
}

} // namespace
} // namespace surflect::stage
