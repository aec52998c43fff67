// "For nonuniform stretches, the object texture may appear to be shifted." [Weyrich 2005, §4.4]
//
// A plate with a spot, and a parallel plane at height h as its impostor, seen at the angle theta from a
// captured direction; both are scaled by (s_x, s_y, s_z). The frame of the impostor only stretches, so L is
// the identity, and the look-up at the impostor point p* = S p, p_z = h, returns what p + t v meets:
//   x_answered = p_x - h tan(theta),     x_seen = p_x - (s_z / s_x) h tan(theta).
// The spot at x_answered is therefore seen at s_x x_seen, displaced on the stretched plate by
//   s_x (x_seen - x_answered) = h tan(theta) (s_x - s_z).
#include "bench/accuracy/claims.h"
#include "bench/accuracy/plate.h"
#include "render/surfels/frame.h"

#include <fmt/format.h>

namespace surflect::bench {

namespace {

constexpr double kSpotX = 0.1, kSpotY = -0.05, kSpotSigma = 0.08, kBackground = 0.2;

double textureAt(double x, double y) {
  const double dx = x - kSpotX, dy = y - kSpotY;
  return kBackground + 0.6 * std::exp(-(dx * dx + dy * dy) / (2 * kSpotSigma * kSpotSigma));
}

// Photograph of the plate by a camera of cameraAbove(theta); a pixel is the mean of samples.
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

double statedParallax(double height, Angle theta, const Vec3<double>& factors) {
  return height * std::tan(theta.radians()) * (factors.x() - factors.z());
}

// Displacement of the spot's centre on the stretched plate in a rendering.
double measuredParallax(double height, Angle theta, const Vec3<double>& factors,
                        const std::filesystem::path& work) {
  const auto camera = cameraAbove<AcquisitionSpace>(theta, 96, 1);
  const image::Image photograph = photographOf(camera, theta);
  const model::Model model = packPlate(work, camera, {}, std::span(&photograph, 1), 0.9, height, 15000);

  const auto viewer = cameraAbove<ObjectSpace>(theta, 160, 1.6);
  surfels::FrameWorkspace workspace(model, size_t{1} << 26);
  const surfels::FrameLayers film =
      surfels::renderFrame(model, {*warp::scaleWarp(factors, {0, 0, 0}), viewer, {}}, {}, workspace);

  // Centre of all that is brighter than the background, within six sigmas of the expected position. The
  // camera is tilted about y, so that x on the plate stays proportional to x in the picture.
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

} // namespace

Json textureParallax(const std::filesystem::path& folder) {
  const Angle theta = Angle::fromDegrees(35);
  Json report = Json::array();
  for (const double height : {0.05, 0.1, 0.2})
    for (const Vec3<double>& factors :
         {Vec3<double>(1.25, 1, 1), Vec3<double>(1.5, 1, 1), Vec3<double>(1.5, 1.5, 1.5)})
      report.push_back({{"height", height},
                        {"stretch", {factors.x(), factors.y(), factors.z()}},
                        {"stated", statedParallax(height, theta, factors)},
                        {"measured", measuredParallax(height, theta, factors,
                                                      folder / fmt::format("parallax-{}", report.size()))}});
  return report;
}

} // namespace surflect::bench
