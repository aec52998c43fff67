#include "srf/capture/rounded_rotations.h"

#include "surfel/base/error.h"
#include "surfel/base/message_text.h"
#include "surfel/math/nearest_rotation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace surflect::capture {

namespace {

// Tolerance. Errors of half a unit in the third decimal change |a|^2 of a column, and a . b of two, by up to
// sqrt(3) 1e-3. With two decimals a camera would be off by half a degree, many pixels, so that is refused.
constexpr double kLimit = 2e-3;
constexpr double kSaid = 1e-4; // reported above; single precision and six decimals are well below

// Largest entry of |R^T R - 1|.
double deviationOf(const Mat3<double>& matrix) {
  return (matrix.transpose() * matrix - Mat3<double>::Identity()).cwiseAbs().maxCoeff();
}

std::string twoDigits(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", number);
  return text;
}

std::string rotationsAre(size_t count) { return counted(count, "rotation") + (count == 1 ? " is" : " are"); }

} // namespace

void RoundedRotations::count(double deviation) {
  if (deviation > kSaid) ++rounded_;
  largestDeviation_ = std::max(largestDeviation_, deviation);
}

Mat3<double> RoundedRotations::nearest(const Mat3<double>& matrix) {
  const double deviation = deviationOf(matrix);
  if (!(deviation <= kLimit))
    throw Error::mismatch("a rotation, with 3 decimals or more",
                          "a matrix that is not orthonormal by " + numberText(deviation));
  if (matrix.determinant() < 0) throw Error::mismatch("a rotation", "a reflection");
  count(deviation);
  // Keep an exact rotation bit by bit.
  return deviation > 1e-14 ? nearestRotation(matrix) : matrix;
}

Mat3<double> RoundedRotations::nearestUnscaled(const Mat3<double>& worldFromCamera) {
  const double scale = std::cbrt(std::abs(worldFromCamera.determinant()));
  const bool scaled =
      scale > 0 && deviationOf(worldFromCamera) > kLimit && deviationOf(worldFromCamera / scale) <= kLimit;
  const Mat3<double> rotation = nearest(scaled ? Mat3<double>(worldFromCamera / scale) : worldFromCamera);
  if (scaled) {
    ++scaled_;
    leastScale_ = std::min(leastScale_, scale);
    mostScale_ = std::max(mostScale_, scale);
  }
  return rotation;
}

std::vector<std::string> RoundedRotations::notes() const {
  std::vector<std::string> notes;
  if (rounded_ > 0)
    notes.push_back(rotationsAre(rounded_) + " rounded, off by up to " + twoDigits(largestDeviation_) +
                    "; the nearest rotation is taken");
  if (scaled_ > 0) {
    const std::string least = numberText(std::round(leastScale_ * 1e4) / 1e4),
                      most = numberText(std::round(mostScale_ * 1e4) / 1e4);
    notes.push_back(rotationsAre(scaled_) + " scaled, by " + least + (least != most ? " to " + most : "") +
                    "; the scale is left out");
  }
  return notes;
}

} // namespace surflect::capture
