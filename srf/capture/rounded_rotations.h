// Orthonormalises rotations of a file whose digits were rounded or that include a scale.
#pragma once

#include "surfel/math/space.h"

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace surflect::capture {

// Orthonormalises the rotations of one file, and counts its changes.
class RoundedRotations {
public:
  // Nearest rotation to a finite matrix whose entries were rounded to three decimals or more. Throws Error
  // for a reflection, scale or shear.
  Mat3<double> nearest(const Mat3<double>& matrix);
  // Nearest rotation to that of a camera-to-world matrix, which may be scaled: its columns are the camera's
  // axes, so rays keep their directions.
  Mat3<double> nearestUnscaled(const Mat3<double>& worldFromCamera);
  // Counts a rotation that was already orthonormalised, for notes().
  void count(double deviation);

  // Notes for the user: number of rotations off by more than 1e-4, and number of scaled ones.
  std::vector<std::string> notes() const;

private:
  size_t rounded_ = 0, scaled_ = 0;
  double largestDeviation_ = 0;
  double leastScale_ = std::numeric_limits<double>::infinity(), mostScale_ = 0;
};

} // namespace surflect::capture
