// The baseline that guesses a material: one camera's training photographs as a Lambert surface.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/proxy/relief/photometric.h"
#include "surfel/base/progress.h"

namespace surflect::evaluation {

class LambertView {
public:
  // Fits the training photographs taken from `view`, under directional or point lights. `object` has the
  // view's alpha as its last channel; it counts where the photographs have no matte. Throws Error where there
  // are no such photographs or their lights do not tell normals, and Cancelled.
  LambertView(const capture::Capture& training, const capture::View& view, const image::Image& object,
              const Progress& progress);

  // The view under another light: RGBA, premultiplied.
  image::Image under(const capture::Light& light) const;

private:
  capture::Camera<AcquisitionSpace> camera_;
  image::Image alpha_; // 1 channel
  relief::LambertImage fits_;
};

} // namespace surflect::evaluation
