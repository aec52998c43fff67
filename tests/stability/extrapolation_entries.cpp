#include "tests/stability/entry.h"

#include "bench/accuracy/claims.h"
#include "render/evaluation/measure.h"
#include "tests/render/films.h"

namespace surflect::stability {
namespace {

using studio::cameraFrom;
using studio::PackedStudio;
using studio::pictureSize;

using Lights = std::vector<scene::ShotLight>;

// A glossy sphere, packed once.
const PackedStudio& glossy() {
  static const PackedStudio packed({.cameras = 24, .lights = 24, .size = pictureSize, .gloss = 0.3f}, 2500);
  return packed;
}
const PackedStudio& matte() {
  static const PackedStudio packed({.cameras = 14, .lights = 40, .size = pictureSize}, 2500);
  return packed;
}

image::Image frame(const model::Model& model, const capture::Camera<ObjectSpace>& camera,
                   const Lights& lights, const warp::Warp& warp, bool isNaive) {
  surfels::FrameOptions options;
  options.shade.nearest = isNaive;
  return studio::filmOf(model, warp, camera, lights, options).color;
}

double rms(const image::Image& truth, const image::Image& film, const image::Mask& mask) {
  return std::sqrt(evaluation::squaredError(truth, film, mask).mean());
}

// RMS error of views at an angle from captured cameras, under captured lights: over the highlight and the
// rest.
Measured viewGap(double degrees) {
  const PackedStudio& packed = glossy();
  Measured sum;
  int count = 0;
  for (size_t v = 0; v < packed.model.rig.views.size(); v += 5) {
    const capture::Viewpoint<AcquisitionSpace> captured(packed.model.rig.views[v].camera);
    const Vec3<double> own = captured.place().normalized();
    const Vec3<double> direction =
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, own.unitOrthogonal()) * own;
    const auto camera = cameraFrom<ObjectSpace>(direction, pictureSize);
    const studio::SphereView view = studio::viewSphere(camera, 3);
    const Vec3<float> eye = (studio::cameraDistance * direction).cast<float>();
    for (size_t l = 0; l < packed.model.rig.lights.size(); ++l) {
      const capture::Light& light = packed.model.rig.lights[l];
      const Vec3<float> towards = capture::towardsLight(light, {0, 0, 0}).raw().cast<float>();
      if (double{towards.dot(direction.cast<float>())} < 0.2) continue;
      const Rgb irradiance = capture::irradianceAt(light, {0, 0, 0});
      const image::Image truth = studio::overBlack(view, [&](const Vec3<float>& n) {
        return studio::lambert({0.8f, 0.5f, 0.3f}, irradiance, n, towards) +
               0.3f * studio::highlight(irradiance, n, towards, (eye - n).normalized());
      });
      const auto still = studio::noWarp();
      const Lights lights{scene::inObjectSpace(light)};
      const image::Mask mask = studio::interiorOf(view);
      sum.naive += rms(truth, frame(packed.model, camera, lights, *still, true), mask);
      sum.ours += rms(truth, frame(packed.model, camera, lights, *still, false), mask);
      ++count;
    }
  }
  return {sum.naive / count, sum.ours / count};
}

// Values of pixels that are not finite under a point light at a place.
Measured lightAt(const Vec3<double>& position) {
  const PackedStudio& packed = matte();
  const auto camera = cameraFrom<ObjectSpace>({0.2, 0.3, 1}, pictureSize);
  const auto still = studio::noWarp();
  const Lights lights{scene::ShotPointLight{assume<Point3<ObjectSpace, double>>(position), {1, 1, 1}}};
  // Naive: I / d^2 at every surfel.
  Measured count;
  for (const auto& p : packed.model.cloud.p0)
    count.naive += !std::isfinite(static_cast<float>(1 / (position - p.raw().cast<double>()).squaredNorm()));
  for (const float value : frame(packed.model, camera, lights, *still, false).values)
    count.ours += !std::isfinite(value);
  return count;
}

// Relative error of a matte sphere's total radiance under a point light close to it.
Measured closeLight(double distance) {
  const PackedStudio& packed = matte();
  const Vec3<double> towards = Vec3<double>(0.2, 0.3, 1).normalized();
  const auto camera = cameraFrom<ObjectSpace>(towards, pictureSize);
  const Vec3<double> position = (1 + distance) * Vec3<double>(0.25, 0.3, 0.95).normalized();
  const Lights lights{scene::ShotPointLight{assume<Point3<ObjectSpace, double>>(position), {1, 1, 1}}};
  const auto still = studio::noWarp();
  const studio::SphereView view = studio::viewSphere(camera, 16);
  const image::Image truth = studio::overBlack(view, [&](const Vec3<float>& n) {
    const Vec3<float> toLight = position.cast<float>() - n;
    return studio::lambert({0.8f, 0.5f, 0.3f}, 1 / toLight.squaredNorm() * Rgb{1, 1, 1}, n,
                           toLight.normalized());
  });
  const auto total = [](const image::Image& picture) {
    double sum = 0;
    for (size_t i = 0; i < picture.values.size(); i += 4) sum += double{picture.values[i]};
    return sum;
  };
  const double wanted = total(truth);
  return {std::abs(total(frame(packed.model, camera, lights, *still, true)) / wanted - 1),
          std::abs(total(frame(packed.model, camera, lights, *still, false)) / wanted - 1)};
}

// Brightness of the sphere under a light inside of it, over that under a light as near outside.
Measured lightInside() {
  const PackedStudio& packed = matte();
  const Vec3<double> towards = Vec3<double>(0.2, 0.3, 1).normalized();
  const auto camera = cameraFrom<ObjectSpace>(towards, pictureSize);
  const auto still = studio::noWarp();
  const auto brightness = [&](double radius) {
    const Lights lights{
        scene::ShotPointLight{assume<Point3<ObjectSpace, double>>(radius * towards), {1, 1, 1}}};
    double sum = 0;
    const image::Image film = frame(packed.model, camera, lights, *still, false);
    for (size_t i = 0; i < film.values.size(); i += 4) sum += double{film.values[i]};
    return sum;
  };
  double naive = 0, outside = 0;
  for (const auto& p0 : packed.model.cloud.p0) {
    const Vec3<double> p = p0.raw().cast<double>(), in = 0.8 * towards - p, out = 1.2 * towards - p;
    naive += std::abs(in.dot(p)) / std::pow(in.norm(), 3);
    outside += std::max(0.0, out.dot(p)) / std::pow(out.norm(), 3);
  }
  return {naive / outside, brightness(0.8) / brightness(1.2)};
}

// Object and cameras and lights turned together; naive: lights and viewer are not brought back by L.
Pictures turnedPictures(int size) {
  const PackedStudio& packed = matte();
  std::mt19937 random(4);
  const studio::RigidMotion motion = studio::randomMotion(random);
  const auto camera = cameraFrom<ObjectSpace>({0.3, 0.5, 1}, size);
  const Vec3<double> towards = Vec3<double>(0.5, 0.2, 1).normalized();
  const auto sun = [](const Vec3<double>& d) {
    return Lights{scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(d), {3, 3, 3}}};
  };
  const auto still = studio::noWarp();
  const image::Image rest = frame(packed.model, camera, sun(towards), *still, false);
  const Vec3<double> turned = motion.rigid().rotation() * towards;
  const image::Image moved = frame(packed.model, motion(camera), sun(turned), *motion.warp(), false);
  const image::Image naive = frame(packed.model, camera, sun(turned), *still, false);
  return {naive, moved, rest};
}

Measured turnedTogether() {
  const auto [naive, ours, truth] = turnedPictures(pictureSize);
  return {studio::largestDifference(truth, naive), studio::largestDifference(truth, ours)};
}

// A part of the sphere that no view sees. Naive: without fallback views, it is black. Truth: all views see
// it.
Pictures unseenPictures(int size) {
  const PackedStudio& packed = matte();
  model::Model blind = model::openModel(packed.model.folder);
  const auto camera = cameraFrom<ObjectSpace>({1, 0.2, 0.1}, size);
  const Lights lights{scene::ShotDirectionalLight{{0.8, 0.6, 0}, {3, 3, 3}}};
  const auto still = studio::noWarp();
  Pictures pictures;
  pictures.truth = frame(packed.model, camera, lights, *still, false);
  for (size_t i = 0; i < blind.cloud.size(); ++i) {
    if (blind.cloud.p0[i].x() < 0.5f) continue;
    std::fill_n(blind.visibility.values.begin() + static_cast<std::ptrdiff_t>(i * blind.visibility.views),
                blind.visibility.views, uint8_t{0});
  }
  pictures.ours = frame(blind, camera, lights, *still, false);
  pictures.naive = pictures.truth;
  const studio::SphereView view = studio::viewSphere(camera, 1);
  for (size_t pixel = 0; pixel + 1 < view.first.size(); ++pixel)
    if (view.first[pixel] < view.first[pixel + 1] && view.normals[view.first[pixel]].x() >= 0.5f)
      std::fill_n(pictures.naive.values.begin() + static_cast<std::ptrdiff_t>(4 * pixel), 3, 0.f);
  return pictures;
}

// Share of the brightness of the middle of the sphere, which no view sees, that is lost.
Measured unseenPart() {
  const Pictures pictures = unseenPictures(pictureSize);
  Measured lost;
  double sum = 0;
  for (int y = 12; y < 28; ++y)
    for (int x = 12; x < 28; ++x) {
      const double seen{pictures.truth.at(x, y)[0]};
      sum += seen;
      lost.ours += std::abs(seen - double{pictures.ours.at(x, y)[0]});
      lost.naive += std::abs(seen - double{pictures.naive.at(x, y)[0]});
    }
  return {lost.naive / sum, lost.ours / sum};
}

// Relative RMS error of radiance of a textured glossy sphere under a twist of 40 degrees, looked up on an
// impostor at a distance from it, in radii. Naive: directions are not brought back by L.
Measured impostorDistance(double distance) {
  static const bench::Json limit = bench::impostorLimit();
  for (const bench::Json& row : limit["twist"])
    if (row["distance"] == distance) return {row["error_without_l"], row["error"]};
  return {kNoAnswer, kNoAnswer};
}

} // namespace

Group extrapolationGroup() {
  const auto onSurfel = [] { return lightAt(matte().model.cloud.p0[700].raw().cast<double>()); };
  return {
      "Frames: extrapolation and lights at hard places",
      "the nearest camera and light alone",
      {
          {"glossy sphere, view 0 degrees from a camera", "its photograph", "RMS error", 0.029,
           [] { return viewGap(0); }},
          {"glossy sphere, view 10 degrees from a camera", "highlights move", "RMS error", 0.11,
           [] { return viewGap(10); }},
          {"glossy sphere, view 20 degrees from a camera", "highlights move", "RMS error", 0.14,
           [] { return viewGap(20); }},
          {"object, camera and light turned together", "nothing changes", "largest difference", 2.6e-6,
           turnedTogether, "directions not brought back by L"},
          {"a part that no view sees", "fallback views show it", "share of brightness lost", 0.1, unseenPart,
           "views that see it alone"},
          {"impostor 0.2 radii from a sphere under a twist", "an error in proportion to the distance",
           "relative error of radiance", 0.12, [] { return impostorDistance(0.2); },
           "directions not brought back by L"},
          {"impostor 0.05 radii from it", "an error in proportion to the distance",
           "relative error of radiance", 0.028, [] { return impostorDistance(0.05); },
           "directions not brought back by L"},
          {"impostor on the sphere", "its radiance", "relative error of radiance", 1.3e-7,
           [] { return impostorDistance(0); }, "directions not brought back by L"},
          {"light at a surfel", "finite pixels", "values not finite", 0, onSurfel, "I / d^2"},
          {"light inside of the object", "its surface stays dark", "brightness, of a light as near outside",
           0.02, lightInside, "a cosine that is not cut off at 0"},
          {"light 0.5 from a matte sphere of radius 1", "its closed form", "relative error of brightness",
           0.003, [] { return closeLight(0.5); }},
          {"light 0.1 from it, surfels 0.07 apart", "its closed form", "relative error of brightness", 0.012,
           [] { return closeLight(0.1); }},
          {"light 0.03 from it, closer than surfels are", "its closed form", "relative error of brightness",
           0.055, [] { return closeLight(0.03); }},
      },
      {{"turned", [] { return turnedPictures(144); }}, {"unseen", [] { return unseenPictures(144); }}}};
}

} // namespace surflect::stability
