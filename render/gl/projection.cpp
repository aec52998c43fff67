#include "render/gl/projection.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>

namespace surflect::gl {

DepthRange depthRangeOf(const Eigen::AlignedBox3d& boxCamera) {
  constexpr double kMargin = 1e-3, kLargestRatio = 1e4;
  const double nearest = -boxCamera.max().z(), farthest = -boxCamera.min().z();
  if (farthest <= 0) return {}; // behind the camera, where nothing is drawn
  const double far = (1 + kMargin) * farthest;
  return {std::max((1 - kMargin) * nearest, far / kLargestRatio), far};
}

Eigen::Matrix4d clipFromCamera(const capture::Lens& lens, const DepthRange& range) {
  if (lens.model != capture::Lens::Model::pinhole)
    throw Error::mismatch("pinhole", "orthographic").at("lens.model");
  if (lens.distorts()) throw Error::mismatch("none: OpenGL draws straight lines", "distortion").at("lens");
  assert(0 < range.near && range.near < range.far);
  const double w = lens.width, h = lens.height, n = range.near, f = range.far;
  // With d = -z, pixel positions are cx + fx x / d and cy - fy y / d, rows counted downwards. Clip
  // coordinates divided by d are -1..1 from left to right and from bottom to top, and 0..1 from near to far.
  Eigen::Matrix4d m;
  m << 2 * lens.focalX / w, 0, 1 - 2 * lens.centerX / w, 0, //
      0, 2 * lens.focalY / h, 2 * lens.centerY / h - 1, 0,  //
      0, 0, -f / (f - n), -f * n / (f - n),                 //
      0, 0, -1, 0;
  return m;
}

} // namespace surflect::gl
