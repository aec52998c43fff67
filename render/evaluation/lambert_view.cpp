#include "render/evaluation/lambert_view.h"

#include "srf/capture/photograph.h"
#include "srf/image/mask.h"
#include "srf/image/over_black.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <utility>

namespace surflect::evaluation {

namespace {

bool isSame(const capture::View& a, const capture::View& b) {
  const auto &p = a.camera.cameraFromWorld, &q = b.camera.cameraFromWorld;
  return a.identity == b.identity && a.camera.lens == b.camera.lens && p.rotation() == q.rotation() &&
         p.translation() == q.translation();
}

} // namespace

LambertView::LambertView(const capture::Capture& training, const capture::View& view,
                         const image::Image& object, const Progress& progress)
    : camera_(view.camera) {
  std::vector<size_t> frames;
  std::vector<capture::Light> lights;
  for (size_t i = 0; i < training.frames.size(); ++i)
    if (const capture::Frame& frame = training.frames[i];
        frame.light && isSame(training.views[frame.view], view)) {
      frames.push_back(i);
      lights.push_back(training.lights[*frame.light]);
    }
  capture::ViewPhotographs photographs = capture::readViewPhotographs(training, frames, progress);
  alpha_ = photographs.hasMatte ? std::move(photographs.alpha) : image::Image(object.width, object.height, 1);
  if (!photographs.hasMatte)
    for (size_t i = 0; i < alpha_.values.size(); ++i)
      alpha_.values[i] = object.values[(i + 1) * static_cast<size_t>(object.channels) - 1];
  image::Mask shown(alpha_.width, alpha_.height);
  std::ranges::transform(alpha_.values, shown.inside.begin(), [](float alpha) { return alpha > 0; });
  try {
    fits_ = relief::fitLambert(camera_, lights, photographs.radiance, shown, progress);
  } catch (Error& error) {
    throw std::move(error).at("the Lambert baseline of " + view.identity).in(training.file);
  }
}

image::Image LambertView::under(const capture::Light& light) const {
  return image::overBlack(relief::relit(fits_, camera_, light), alpha_);
}

} // namespace surflect::evaluation
