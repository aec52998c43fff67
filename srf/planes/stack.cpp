#include "srf/planes/stack.h"

#include "srf/capture/photograph.h"
#include "srf/proxy/relief/frontal_plane.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace surflect::planes {

namespace {

constexpr double kLeastElevation = 0.02; // sine: a light nearer to the frontal plane is taken as behind it

} // namespace

Stack stackOf(const capture::Capture& given) {
  Stack stack{capture::subset(
                  given, [](const capture::Frame& frame) { return frame.split == capture::Split::train; }),
              {},
              {},
              {},
              {},
              {}};
  capture::Capture& kept = stack.capture;
  if (kept.frames.empty())
    throw Error::mismatch("photographs to train with", "none").at("frames").in(given.file);
  if (const size_t heldOut = given.frames.size() - kept.frames.size(); heldOut > 0)
    stack.notes.push_back(fmt::format("left out: {} that the capture holds out for evaluation",
                                      counted(heldOut, "photograph")));
  if (kept.views.size() != 1)
    throw Error::mismatch("one view", std::to_string(kept.views.size())).at("views").in(given.file);
  if (!kept.frames.front().light)
    throw Error::mismatch("a light for each photograph", "fixed light").at("lights").in(given.file);
  const capture::Camera<AcquisitionSpace>& camera = kept.views.front().camera;
  const capture::Lens& lens = camera.lens;
  const auto middle =
      relief::imagePoint(lens, {lens.width / 2.0, lens.height / 2.0}).value_or(Vec2<double>(0, 0));
  const Point3<AcquisitionSpace, double> place =
      camera.cameraFromWorld.inverse()(relief::atDepth(lens, middle, relief::frontalDepth(camera)));
  std::vector<std::string> behind;
  std::vector<capture::Frame> before;
  for (const capture::Frame& frame : kept.frames) {
    const capture::Light& light = kept.lights[*frame.light];
    const Vec3<double> towards =
        camera.cameraFromWorld(capture::towardsLight(light, place)).raw().normalized();
    if (!(towards.z() >= kLeastElevation)) {
      behind.push_back(light.name);
      continue;
    }
    if (before.empty()) stack.masked = frame;
    before.push_back(frame);
    before.back().mask.clear();
    stack.lights.push_back(light.name);
    stack.towardsLights.push_back(towards);
    stack.irradiance.push_back(capture::irradianceAt(light, place));
  }
  if (!behind.empty())
    stack.notes.push_back(fmt::format("left out: {} behind the picture's plane ({})",
                                      counted(behind.size(), "light"), firstNames(behind)));
  if (before.size() < 3 || before.size() > kMostPhotographs)
    throw Error::mismatch(fmt::format("3 to {} photographs with lights before the camera", kMostPhotographs),
                          std::to_string(before.size()))
        .at("frames")
        .in(given.file);
  kept.frames = std::move(before);
  return stack;
}

image::Image readPhotograph(const Stack& stack, size_t photograph) {
  const std::array one{photograph};
  image::Image radiance = std::move(capture::readPhotographs(stack.capture, one).front().radiance);
  const Rgb& irradiance = stack.irradiance[photograph];
  const std::array factor{1 / irradiance.r, 1 / irradiance.g, 1 / irradiance.b};
  for (size_t i = 0; i < radiance.values.size(); i += 3)
    for (size_t c = 0; c < 3; ++c) radiance.values[i + c] *= factor[c];
  return radiance;
}

Samples sample(const Stack& stack, size_t most, const Progress& progress) {
  Samples samples;
  const size_t all = stack.pixels(), count = std::min(all, most);
  if (count == all) {
    for (size_t i = 0; i < all; ++i) samples.pixels.push_back(i);
  } else {
    const double golden = (std::sqrt(5.0) - 1) / 2;
    for (size_t i = 0; i < count; ++i) {
      const double turns = golden * static_cast<double>(i);
      samples.pixels.push_back(static_cast<size_t>((turns - std::floor(turns)) * static_cast<double>(all)));
    }
    std::ranges::sort(samples.pixels);
  }
  capture::Capture masked = stack.capture;
  masked.frames = {stack.masked};
  const std::array first{size_t{0}};
  const image::Image alpha = std::move(capture::readPhotographs(masked, first).front().alpha);
  for (const size_t pixel : samples.pixels) samples.inside.push_back(alpha.values[pixel] > 0.5f);
  const auto columns = static_cast<Eigen::Index>(count);
  samples.linear.resize(static_cast<Eigen::Index>(3 * stack.size()), columns);
  for (size_t p = 0; p < stack.size(); ++p) {
    progress("reading", static_cast<double>(p) / static_cast<double>(stack.size()));
    const image::Image photograph = readPhotograph(stack, p);
    for (Eigen::Index i = 0; i < columns; ++i)
      for (size_t c = 0; c < 3; ++c)
        samples.linear(static_cast<Eigen::Index>(3 * p + c), i) =
            photograph.values[3 * samples.pixels[static_cast<size_t>(i)] + c];
  }
  return samples;
}

float whiteOf(const Samples& samples, double below) {
  image::PercentileCounter counter;
  for (Eigen::Index i = 0; i < samples.linear.cols(); ++i)
    if (samples.inside[static_cast<size_t>(i)] != 0)
      for (const float value : samples.linear.col(i)) counter.add(value);
  const auto white = static_cast<float>(counter.percentile(below));
  return white > 0 ? white : 1;
}

} // namespace surflect::planes
