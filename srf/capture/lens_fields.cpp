#include "srf/capture/lens_fields.h"

#include "srf/image/picture_limits.h"
#include "surfel/math/angle.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace surflect::capture {

namespace {

double fieldOfView(const Json& value) {
  const double angle = positiveOf(value);
  if (!(angle < std::numbers::pi)) throw Error::mismatch("radians below pi", shown(value));
  return angle;
}

double fieldOfViewDegrees(const Json& value) {
  const double angle = positiveOf(value);
  if (!(angle < 180)) throw Error::mismatch("degrees below 180", shown(value));
  return Angle::fromDegrees(angle).radians();
}

// Returns whether two angles in radians are equal up to rounding to two decimals or to whole degrees.
bool sameAngle(double a, double b) { return std::abs(a - b) <= 0.01; }

// Angle in NeRF's radians or, under another key, instant-ngp's degrees.
std::optional<double> angleOf(const Json& object, const char* inRadians, const char* inDegrees) {
  const auto radians = optional(object, inRadians, fieldOfView),
             degrees = optional(object, inDegrees, fieldOfViewDegrees);
  if (radians && degrees && !sameAngle(*radians, *degrees))
    throw Error::mismatch("about " + numberText(Angle::fromRadians(*radians).degrees()) + ", as " +
                              inRadians + " says",
                          shown(valueAt(object, inDegrees)))
        .at(inDegrees);
  return radians ? radians : degrees;
}

Lens::Model lensModel(const Json& value) {
  using enum Lens::Model; // nerfstudio's names are COLMAP's
  return oneOf<Lens::Model>(value, {{"pinhole", pinhole},
                                    {"orthographic", orthographic},
                                    {"PINHOLE", pinhole},
                                    {"SIMPLE_PINHOLE", pinhole},
                                    {"SIMPLE_RADIAL", pinhole},
                                    {"RADIAL", pinhole},
                                    {"OPENCV", pinhole}});
}

// f = size / 2 / tan(angle / 2) for the angle between opposite edges of the picture.
double focalLengthOf(double angle, int size) { return size / 2. / std::tan(angle / 2); }

std::optional<double> focalLength(std::optional<double> stated, std::optional<double> angle, int size) {
  return stated || !angle ? stated : focalLengthOf(*angle, size);
}

} // namespace

LensFields readLensFields(const Json& object) {
  return {.model = optional(object, "camera_model", lensModel),
          .width = optional(object, "w", pixelCountOf),
          .height = optional(object, "h", pixelCountOf),
          .focalX = optional(object, "fl_x", positiveOf),
          .focalY = optional(object, "fl_y", positiveOf),
          .angleX = angleOf(object, "camera_angle_x", "x_fov"),
          .angleY = angleOf(object, "camera_angle_y", "y_fov"),
          .orthoHeight = optional(object, "ortho_height", positiveOf),
          .centerX = optional(object, "cx", coordinateOf),
          .centerY = optional(object, "cy", coordinateOf),
          .k1 = optional(object, "k1", numberOf),
          .k2 = optional(object, "k2", numberOf),
          .p1 = optional(object, "p1", numberOf),
          .p2 = optional(object, "p2", numberOf)};
}

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

LensFields withSize(LensFields lens, image::PictureSize picture) {
  const double shape = static_cast<double>(picture.width) / picture.height;
  const auto pixels = [](double x) {
    return static_cast<int>(std::clamp<double>(std::round(x), 1, image::kMostSide));
  };
  if (!lens.width) lens.width = lens.height ? pixels(*lens.height * shape) : picture.width;
  if (!lens.height) lens.height = pixels(*lens.width / shape);
  return lens;
}

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
