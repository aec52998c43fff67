#include "bench/claims/texture_parallax.h"

#include "bench/claims/plate.h"
#include "render/surfels/frame.h"

namespace surflect::bench {

namespace {

constexpr double kSpotX = 0.1, kSpotY = -0.05, kSpotSigma = 0.08, kBackground = 0.2;

double textureAt(double x, double y) {
  const double dx = x - kSpotX, dy = y - kSpotY;
  return kBackground + 0.6 * std::exp(-(dx * dx + dy * dy) / (2 * kSpotSigma * kSpotSigma));
}

// What a camera of cameraAbove(theta) sees of the plate, at the middles of the parts of a pixel.
image::Image photographOf(const capture::Camera<AcquisitionSpace>& camera, Angle theta) {
  constexpr int kParts = 4;
  image::Image image(camera.lens.width, camera.lens.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double sum = 0;
      for (int part = 0; part < kParts * kParts; ++part) {
        const double px = x + (part % kParts + 0.5) / kParts, py = y + (part / kParts + 0.5) / kParts;
        const double right = (px - camera.lens.centerX) / camera.lens.focalX;
        sum += textureAt(right / std::cos(theta.radians()), (camera.lens.centerY - py) / camera.lens.focalY);
      }
      for (float& value : image.at(x, y)) value = static_cast<float>(sum / (kParts * kParts));
    }
  return image;
}

} // namespace

double statedParallax(double height, Angle theta, const Vec3<double>& factors) {
  return height * std::tan(theta.radians()) * (factors.x() - factors.z());
}

double measuredParallax(double height, Angle theta, const Vec3<double>& factors,
                        const std::filesystem::path& work) {
  const auto camera = cameraAbove<AcquisitionSpace>(theta, 96, 1);
  const image::Image photograph = photographOf(camera, theta);
  const model::Model model = packPlate(work, camera, {}, std::span(&photograph, 1), 0.9, height, 15000);

  const auto viewer = cameraAbove<ObjectSpace>(theta, 160, 1.6);
  codec::BlockCache cache(model.files, size_t{1} << 26);
  surfels::FrameStats stats;
  const surfels::FrameLayers film =
      surfels::renderFrame(model, *warp::scaleWarp(factors, {0, 0, 0}), viewer, {}, {}, cache, stats);

  // Centre of what is brighter than the background, within six sigmas of where the spot should be. A camera
  // that looks along the plate's own parallels keeps x on the plate and x on the picture in proportion.
  const double scaleX = viewer.lens.focalX * std::cos(theta.radians()), scaleY = viewer.lens.focalY;
  double mass = 0, moment = 0;
  for (int y = 0; y < film.color.height; ++y)
    for (int x = 0; x < film.color.width; ++x) {
      const double plateX = (x + 0.5 - viewer.lens.centerX) / scaleX,
                   plateY = (viewer.lens.centerY - y - 0.5) / scaleY;
      const double dx = plateX / factors.x() - kSpotX, dy = plateY / factors.y() - kSpotY;
      if (dx * dx + dy * dy > 36 * kSpotSigma * kSpotSigma) continue;
      const std::span<const float> pixel = film.color.at(x, y);
      const double excess = pixel[1] - kBackground * pixel[3];
      mass += excess;
      moment += excess * plateX;
    }
  return moment / mass - factors.x() * kSpotX;
}

} // namespace surflect::bench
