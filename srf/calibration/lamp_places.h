// Places of lamps, estimated from the shading of a surface whose shape is known.
//
// A point p with unit normal n and albedo rho, lit by a lamp of intensity I at x, shows
//
//   b = rho I n . (x - p) / |x - p|^3
//
// where it is a Lambert surface: the cosine law and the inverse square of the distance, as in photometric
// stereo by near lamps [Quéau et al. 2018]. In logarithms, albedo is a sum that the mean over a
// point's photographs removes; places and intensities follow by robust nonlinear least squares. A lamp may be
// carried by a camera, as a flash is: its place is then sought in that camera's axes.
//
// [Quéau et al. 2018] Quéau, Durix, Wu, Cremers, Lauze, Durou: LED-Based Photometric Stereo: Modeling,
// Calibration and Numerical Solution, Journal of Mathematical Imaging and Vision 60(3).
#pragma once

#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::calibration {

// Luminance of a surface point in one photograph. `normal` is the mean of the unit normals over what its
// pixels show; it is shorter than 1 where the surface curves within them, which dims it equally.
struct ShadedPoint {
  uint32_t point, photograph;
  float luminance; // linear, above 0
  Vec3<float> normal;
};

// A photograph: the lamp that lit it, where that lamp's axes are, and where the camera is.
struct LampPhotograph {
  size_t lamp = 0;
  Mat3<double> turn = Mat3<double>::Identity(); // world = turn * lamp + shift
  Vec3<double> shift = Vec3<double>::Zero();
  Vec3<double> eye = Vec3<double>::Zero(); // the camera's centre in the world
};

struct ShadedSurface {
  std::vector<Vec3<double>> points;
  std::vector<LampPhotograph> photographs;
  std::vector<ShadedPoint> shades; // in any order

  Vec3<double> middle() const; // mean of the points
};

struct LampPlace {
  Vec3<double> place;          // in the lamp's axes
  Vec3<double> standardErrors; // of its coordinates, by leaving out parts of the surface
  // From the middle of the points, in the first photograph: standard errors of 1 / distance over 1 /
  // distance, and of the direction in radians.
  double errorOfDistance = 0, errorOfDirection = 0;
  double strength = 1; // intensity relative to the other lamps; 1 if there is one
  size_t shades = 0;   // number that the fit accepts
  double misfit = 0;   // median over all lamps' shades of |log(shown / fitted)|
};

// Places of all lamps, from the given first guesses (#lamps). Shades near mirror direction, grazing and dark
// ones are left out; highlights and shadows count little (Cauchy weights). Throws Error where fewer than 50
// points are seen in two photographs that the fit accepts; throws Cancelled; progress names the stage
// "lamps". Cost: #points x #lamps^2 for each of up to 140 iterations. The result does not depend on the
// number of threads.
std::vector<LampPlace> lampPlaces(const ShadedSurface& surface, std::span<const Vec3<double>> guesses,
                                  const Progress& progress = {});

// First guesses for lamps in the world: in the direction by which a Lambert surface of the mean luminance as
// its albedo shows what a lamp's photographs do, `distance` from the middle of the points.
std::vector<Vec3<double>> guessedPlaces(const ShadedSurface& surface, size_t lamps, double distance);

} // namespace surflect::calibration
