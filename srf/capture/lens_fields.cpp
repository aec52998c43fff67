#include "srf/capture/lens_fields.h"

#include "surfel/error.h"

#include <cassert>
#include <cmath>

namespace surflect {

LensFields inherit(LensFields frame, const LensFields& capture) {
  if (!frame.focalX && !frame.angleX) {
    frame.focalX = capture.focalX;
    frame.angleX = capture.angleX;
    if (!frame.focalY) frame.focalY = capture.focalY;
  }
  const auto take = [](auto& own, const auto& outer) {
    if (!own) own = outer;
  };
  take(frame.model, capture.model);
  take(frame.width, capture.width);
  take(frame.height, capture.height);
  take(frame.orthoHeight, capture.orthoHeight);
  take(frame.centerX, capture.centerX);
  take(frame.centerY, capture.centerY);
  take(frame.k1, capture.k1);
  take(frame.k2, capture.k2);
  take(frame.p1, capture.p1);
  take(frame.p2, capture.p2);
  return frame;
}

Lens lensOf(const LensFields& fields) {
  assert(fields.width && fields.height);
  Lens lens{
      .model = fields.model.value_or(Lens::Model::pinhole), .width = *fields.width, .height = *fields.height};
  if (lens.model == Lens::Model::orthographic) {
    if (!fields.orthoHeight) throw Error::mismatch("a number above 0", "nothing").at("ortho_height");
    lens.focalX = lens.focalY = lens.height / *fields.orthoHeight;
  } else {
    if (!fields.focalX && !fields.angleX)
      throw Error::mismatch("a number above 0, or camera_angle_x", "nothing").at("fl_x");
    lens.focalX = fields.focalX ? *fields.focalX : lens.width / 2. / std::tan(*fields.angleX / 2);
    lens.focalY = fields.focalY.value_or(lens.focalX);
  }
  lens.centerX = fields.centerX.value_or(lens.width / 2.);
  lens.centerY = fields.centerY.value_or(lens.height / 2.);
  lens.k1 = fields.k1.value_or(0);
  lens.k2 = fields.k2.value_or(0);
  lens.p1 = fields.p1.value_or(0);
  lens.p2 = fields.p2.value_or(0);
  return lens;
}

} // namespace surflect
