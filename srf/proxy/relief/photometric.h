// Photometric stereo: what a Lambert surface would have to be to look, in each pixel of one view, as it does
// under several lights.
//
// [Woodham 1980] R. J. Woodham: Photometric Method for Determining Surface Orientation from Multiple Images,
// Optical Engineering 19(1).
// [Rousseeuw 1987] P. J. Rousseeuw, A. M. Leroy: Robust Regression and Outlier Detection, Wiley.
//
// Symbols: l_i unit direction to light i, E_i its irradiance, I_i radiance, y_i = pi I_i / E_i reflected
// share, n unit normal, rho albedo.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/progress.h"

#include <span>

namespace surflect::relief {

// y_i = rho max(0, n . l_i)  [Woodham 1980, Eq. 4]
struct LambertFit {
  Vec3<double> normal = Vec3<double>::Zero(); // unit; zero where the pixel does not tell
  Rgb albedo;                                 // not below 0
  double residual = 0; // root mean square of y_i - rho max(0, n . l_i) over all lights and channels
};

// The fit to one pixel. Shadows and highlights are left out: least absolute deviations find the lights that
// agree, least squares on these the rest [Rousseeuw 1987, §5]. Needs 3 lights that do not lie in a plane with
// the point, else the normal is zero. Spans have one entry per light.
LambertFit fitLambert(std::span<const Vec3<double>> towardsLights, std::span<const Rgb> reflectedShares);

// Radiance of what was fitted, under another light.
Rgb lambertRadiance(const LambertFit& fit, const Vec3<double>& towardsLight, Rgb irradiance);

// A fit per pixel of a mask, in acquisition space.
struct LambertImage {
  image::Image normal;   // 3 channels
  image::Image albedo;   // 3 channels
  image::Image residual; // 1 channel

  LambertFit at(int x, int y) const;
};

// Fits every pixel of the mask. One image of radiance (3 channels, of the lens' size) per light. Lights act
// as at the frontal plane, see frontal_plane.h. Throws Error where the lights lie in a plane or are less than
// three, and Cancelled.
LambertImage fitLambert(const capture::Camera<AcquisitionSpace>& camera,
                        std::span<const capture::Light> lights, std::span<const image::Image> radiance,
                        const image::Mask& mask, const Progress& progress);

// What was fitted, under another light: 3 channels, black off the mask.
image::Image relit(const LambertImage& fits, const capture::Camera<AcquisitionSpace>& camera,
                   const capture::Light& light);

} // namespace surflect::relief
