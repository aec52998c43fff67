#include "srf/capture/lens_fields.h"

#include "surfel/base/error.h"

#include <cassert>
#include <cmath>

namespace surflect::capture {

LensFields inherit(LensFields frame, const LensFields& capture) {
  const bool ownX = frame.focalX || frame.angleX, ownY = frame.focalY || frame.angleY;
  if (!ownX) {
    frame.focalX = capture.focalX;
    frame.angleX = capture.angleX;
  }
  if (!ownX && !ownY) {
    frame.focalY = capture.focalY;
    frame.angleY = capture.angleY;
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

namespace {

// f = size / 2 / tan(angle / 2) for the angle between opposite edges of the picture.
double focalLengthOf(double angle, int size) { return size / 2. / std::tan(angle / 2); }

std::optional<double> focalLength(std::optional<double> stated, std::optional<double> angle, int size) {
  return stated || !angle ? stated : focalLengthOf(*angle, size);
}

} // namespace

bool sameAngle(double a, double b) { return std::abs(a - b) <= 0.01; }

std::optional<double> otherFocalLength(std::optional<double> focal, std::optional<double> angle, int size) {
  if (!focal || !angle || sameAngle(*angle, 2 * std::atan(size / 2. / *focal))) return std::nullopt;
  return focalLengthOf(*angle, size);
}

Lens lensOf(const LensFields& fields) {
  assert(fields.width && fields.height);
  Lens lens{
      .model = fields.model.value_or(Lens::Model::pinhole), .width = *fields.width, .height = *fields.height};
  if (lens.model == Lens::Model::orthographic) {
    if (!fields.orthoHeight) throw Error::mismatch("a number above 0", "nothing").at("ortho_height");
    lens.focalX = lens.focalY = lens.height / *fields.orthoHeight;
  } else {
    const auto x = focalLength(fields.focalX, fields.angleX, lens.width),
               y = focalLength(fields.focalY, fields.angleY, lens.height);
    if (!x)
      throw Error::mismatch(
          y ? "a number above 0, or camera_angle_x, as the vertical one does not say whether "
              "pixels are square"
            : "a number above 0, or camera_angle_x",
          "nothing")
          .at("fl_x");
    lens.focalX = *x;
    lens.focalY = y.value_or(*x);
  }
  lens.centerX = fields.centerX.value_or(lens.width / 2.);
  lens.centerY = fields.centerY.value_or(lens.height / 2.);
  lens.k1 = fields.k1.value_or(0);
  lens.k2 = fields.k2.value_or(0);
  lens.p1 = fields.p1.value_or(0);
  lens.p2 = fields.p2.value_or(0);
  return lens;
}

} // namespace surflect::capture
