// Rotations of a file whose digits were rounded, or that carry a scale, made orthonormal.
#pragma once

#include "surfel/math/space.h"

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace surflect::capture {

// The rotations of one file.
class RoundedRotations {
public:
  // Returns the rotation nearest to a finite matrix whose entries were rounded to three decimals or more.
  // Throws Error for a reflection, scale and shear.
  Mat3<double> nearest(const Mat3<double>& matrix);
  // Nearest rotation to that of a camera-to-world matrix, which may be scaled: its columns are the camera's
  // axes, so that the rays keep their directions.
  Mat3<double> nearestUnscaled(const Mat3<double>& worldFromCamera);
  // Counts a rotation that was made orthonormal already, for notes().
  void count(double deviation);

  // Notes for the user: how many rotations were off by more than 1e-4, and how many were scaled.
  std::vector<std::string> notes() const;

private:
  size_t rounded_ = 0, scaled_ = 0;
  double largestDeviation_ = 0;
  double leastScale_ = std::numeric_limits<double>::infinity(), mostScale_ = 0;
};

} // namespace surflect::capture
