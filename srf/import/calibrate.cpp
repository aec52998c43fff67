#include "srf/import/calibrate.h"

#include "srf/calibration/strengths.h"
#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>

namespace surflect::importers {

namespace {

constexpr int64_t kCalibrationPixels = int64_t{1} << 18; // memory: 12 bytes per pixel and photograph

// Converts gradients to the right and down, per pixel, to gradients per scene unit on the plane through the
// origin that faces the camera.
Vec3<double> inSpace(const Vec2<double>& gradient, const capture::Camera<AcquisitionSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  const bool isDistant = lens.model == capture::Lens::Model::orthographic;
  const double depth = isDistant ? 1 : -camera.cameraFromWorld.translation().z();
  assert(depth > 0);
  const Vec3<double> across(gradient.x() * lens.focalX, -gradient.y() * lens.focalY, 0);
  return camera.cameraFromWorld.rotation().transpose() * across / depth;
}

} // namespace

image::Image radianceOf(const capture::Capture& capture, size_t frame) {
  return std::move(capture::readPhotographs(capture, {&frame, 1}).front().radiance);
}

image::Image shrunk(const image::Image& image, int factor) {
  image::Image small(image.width / factor, image.height / factor, image.channels);
  const float share = 1 / static_cast<float>(factor * factor);
  for (int y = 0; y < small.height * factor; ++y)
    for (int x = 0; x < small.width * factor; ++x) {
      const auto from = image.at(x, y);
      const auto to = small.at(x / factor, y / factor);
      for (size_t c = 0; c < to.size(); ++c) to[c] += share * from[c];
    }
  return small;
}

image::Mask shrunk(const image::Mask& mask, int factor) {
  image::Mask small(mask.width / factor, mask.height / factor);
  std::ranges::fill(small.inside, uint8_t{1});
  for (int y = 0; y < small.height * factor; ++y)
    for (int x = 0; x < small.width * factor; ++x)
      small.inside[static_cast<size_t>(y / factor) * static_cast<size_t>(small.width) +
                   static_cast<size_t>(x / factor)] &=
          mask.inside[static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x)];
  return small;
}

image::Mask objectOfView(const capture::Capture& capture, std::span<const size_t> frames, double threshold,
                         const Progress& progress) {
  image::Image brightest; // largest luminance over the photographs, to which the threshold applies
  for (const size_t f : frames) {
    progress.checkpoint();
    const image::Image radiance = radianceOf(capture, f);
    if (brightest.values.empty()) brightest = image::Image(radiance.width, radiance.height, 1);
    for (size_t i = 0; i < brightest.values.size(); ++i) {
      const float* texel = radiance.values.data() + 3 * i;
      brightest.values[i] = std::max(brightest.values[i], image::luma({texel[0], texel[1], texel[2]}));
    }
  }
  return calibration::objectByThreshold({&brightest, 1}, threshold);
}

StrengthEstimate strengthsInView(const capture::Capture& capture, std::span<const size_t> frames,
                                 const image::Mask& object, bool unevenly, const Progress& progress) {
  int factor = 1;
  while (int64_t{object.width / factor} * (object.height / factor) > kCalibrationPixels) ++factor;
  const image::Mask small = shrunk(object, factor);
  std::vector<image::Image> radiance;
  std::vector<Direction3<AcquisitionSpace, double>> towards;
  for (size_t i = 0; i < frames.size(); ++i) {
    progress("light strengths", static_cast<double>(i) / static_cast<double>(frames.size()));
    radiance.push_back(shrunk(radianceOf(capture, frames[i]), factor));
    towards.push_back(
        std::get<capture::DirectionalLight>(capture.lights[*capture.frames[frames[i]].light].kind).towards);
  }
  StrengthEstimate estimate;
  std::vector<calibration::StrengthGradient> gradients(frames.size(), calibration::StrengthGradient::Zero());
  if (unevenly) try {
      std::vector<size_t> training;
      std::vector<image::Image> ofTraining;
      std::vector<Direction3<AcquisitionSpace, double>> towardsTraining;
      for (size_t i = 0; i < frames.size(); ++i) {
        if (capture.frames[frames[i]].split != capture::Split::train) continue;
        training.push_back(i);
        ofTraining.push_back(radiance[i]);
        towardsTraining.push_back(towards[i]);
      }
      const auto found = calibration::lightGradients(ofTraining, small, towardsTraining);
      for (size_t i = 0; i < training.size(); ++i) gradients[training[i]] = found[i];
    } catch (const Error& e) {
      estimate.problem = e.what();
    }
  try {
    const auto strengths = calibration::lightStrengths(radiance, small, towards, gradients);
    const capture::Camera<AcquisitionSpace>& camera = capture.views[capture.frames[frames[0]].view].camera;
    for (size_t i = 0; i < towards.size(); ++i)
      estimate.lights.push_back(
          {towards[i], strengths[i], inSpace(gradients[i] / (small.height * factor), camera)});
  } catch (const Error& e) {
    estimate.problem = e.what();
  }
  return estimate;
}

} // namespace surflect::importers
