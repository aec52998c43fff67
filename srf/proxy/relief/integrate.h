// From normals to depth.
//
// With v = (-x, -y, 1) from the point seen at (x, y) of the image plane towards a pinhole camera, v = (0, 0,
// 1) towards an orthographic one, a surface with normal n has
//   d log(depth) / d(x, y) = (n_x, n_y) / (n . v)   pinhole: what is seen is depth (x, y, -1)
//   d depth / d(x, y) = (n_x, n_y) / (n . v)        orthographic: what is seen is (x, y, -depth)
// which follows from n being at right angles to the derivatives of what is seen.
// [Durou 2020] J.-D. Durou et al.: A Comprehensive Introduction to Photometric 3D-reconstruction, §1.2.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/progress.h"

#include <optional>
#include <vector>

namespace surflect::relief {

// The gradient above; `n` in camera space, of any length. Where the surface is seen at less than about six
// degrees, or from behind, it goes on as if at six. Zero for a zero normal.
Vec2<double> depthGradient(const capture::Lens& lens, const Vec2<double>& imagePoint, const Vec3<double>& n);

struct DepthMap {
  image::Mask mask;
  std::vector<double> depth;          // along the viewing axis, scene units; 0 off the mask
  std::vector<Vec2<double>> gradient; // see above
};

// Depth over the pixels of the mask from normals in acquisition space (3 channels, of any length; zero where
// unknown: there the surface is as smooth as its neighbours allow). Every connected piece of the mask has the
// mean depth of the frontal plane; the geometric mean for a pinhole camera. Pixels without a ray leave the
// mask. Throws Cancelled.
DepthMap integrateNormals(const capture::Camera<AcquisitionSpace>& camera, const image::Image& normals,
                          const image::Mask& mask, const Progress& progress);

} // namespace surflect::relief
