// Photometric stereo: the Lambert surface that best explains each pixel of one view under several lights.
//
// [Woodham 1980] R. J. Woodham: Photometric Method for Determining Surface Orientation from Multiple Images,
// Optical Engineering 19(1). [Rousseeuw 1987] P. J. Rousseeuw, A. M. Leroy: Robust Regression and Outlier
// Detection, Wiley.
//
// Symbols: l_i unit direction to light i, E_i its irradiance, I_i radiance, y_i = pi I_i / E_i reflected
// share, n unit normal, rho albedo.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/time.h"

#include <span>

namespace surflect::relief {

// y_i = rho max(0, n . l_i)  [Woodham 1980, Eq. 4]
struct LambertFit {
  Vec3<double> normal = Vec3<double>::Zero(); // unit; zero where undetermined
  Rgb albedo;                                 // not below 0
  double residual = 0; // root mean square of y_i - rho max(0, n . l_i) over all lights and channels
};

// Robust fit to one pixel. Least absolute deviations select the lights that agree, which rejects shadows and
// highlights; least squares on these give the result [Rousseeuw 1987, §5]. Needs 3 lights not in a plane with
// the point, otherwise the normal is zero. Spans have one entry per light.
LambertFit fitLambert(std::span<const Vec3<double>> towardsLights, std::span<const Rgb> reflectedShares);

// Radiance of a fit under another light.
Rgb lambertRadiance(const LambertFit& fit, const Vec3<double>& towardsLight, Rgb irradiance);

// Fits of all pixels of a mask, in acquisition space.
struct LambertImage {
  image::Image normal;   // 3 channels
  image::Image albedo;   // 3 channels
  image::Image residual; // 1 channel

  LambertFit at(int x, int y) const;
};

// Fits every pixel of the mask. `radiance` has one image (3 channels, of the lens's size) per light.
// Directions to the lights are those at the frontal plane (frontal_plane.h). Throws Error for fewer than
// three lights or lights in a plane, and Cancelled.
LambertImage fitLambert(const capture::Camera<AcquisitionSpace>& camera,
                        std::span<const capture::Light> lights, std::span<const image::Image> radiance,
                        const image::Mask& mask, const Progress& progress);

// Fits under another light: 3 channels, black off the mask.
image::Image relit(const LambertImage& fits, const capture::Camera<AcquisitionSpace>& camera,
                   const capture::Light& light);

} // namespace surflect::relief
