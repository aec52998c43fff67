#include "render/lambert_view.h"

#include "srf/capture/photograph.h"
#include "srf/image/mask.h"
#include "surfel/error.h"

#include <algorithm>

namespace surflect {

namespace {

bool isSame(const View& a, const View& b) {
  const auto &p = a.camera.cameraFromWorld, &q = b.camera.cameraFromWorld;
  return a.identity == b.identity && a.camera.lens == b.camera.lens && p.rotation() == q.rotation() &&
         p.translation() == q.translation();
}

} // namespace

LambertView::LambertView(const Capture& training, const View& view, const Image& object,
                         const Progress& progress)
    : camera_(view.camera), alpha_(object.width, object.height, 1) {
  std::vector<size_t> frames;
  std::vector<Light> lights;
  for (size_t i = 0; i < training.frames.size(); ++i)
    if (const Frame& frame = training.frames[i]; frame.light && isSame(training.views[frame.view], view)) {
      frames.push_back(i);
      lights.push_back(training.lights[*frame.light]);
    }
  auto photographs = readPhotographs(training, frames, progress);
  bool hasMatte = false;
  std::ranges::fill(alpha_.values, 1.f);
  std::vector<Image> radiance;
  for (Photograph& photograph : photographs) {
    hasMatte |= photograph.hasMatte;
    for (size_t i = 0; i < alpha_.values.size(); ++i)
      alpha_.values[i] = std::min(alpha_.values[i], photograph.alpha.values[i]);
    radiance.push_back(std::move(photograph.radiance));
  }
  if (!hasMatte)
    for (size_t i = 0; i < alpha_.values.size(); ++i)
      alpha_.values[i] = object.values[(i + 1) * static_cast<size_t>(object.channels) - 1];
  Mask shown(alpha_.width, alpha_.height);
  std::ranges::transform(alpha_.values, shown.inside.begin(), [](float alpha) { return alpha > 0; });
  try {
    fits_ = fitLambert(camera_, lights, radiance, shown, progress);
  } catch (Error& error) {
    throw std::move(error).at("the Lambert baseline of " + view.identity).in(training.file);
  }
}

Image LambertView::under(const Light& light) const {
  const Image radiance = relit(fits_, camera_, light);
  Image image(alpha_.width, alpha_.height, 4);
  for (size_t i = 0; i < alpha_.values.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) image.values[4 * i + c] = radiance.values[3 * i + c] * alpha_.values[i];
    image.values[4 * i + 3] = alpha_.values[i];
  }
  return image;
}

} // namespace surflect
