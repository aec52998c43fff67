// Lambert baseline: albedo and normals fitted to the training photographs of one camera.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/proxy/relief/photometric.h"
#include "surfel/base/progress.h"

namespace surflect::evaluation {

class LambertView {
public:
  // Fits the training photographs taken from `view`, under directional or point lights. The last channel of
  // `object` is the view's alpha, used if the photographs have no matte. Throws Error if there are no such
  // photographs or their lights do not determine normals, and Cancelled.
  LambertView(const capture::Capture& training, const capture::View& view, const image::Image& object,
              const Progress& progress);

  // Renders the view under another light: RGBA, premultiplied.
  image::Image under(const capture::Light& light) const;

private:
  capture::Camera<AcquisitionSpace> camera_;
  image::Image alpha_; // 1 channel
  relief::LambertImage fits_;
};

} // namespace surflect::evaluation
