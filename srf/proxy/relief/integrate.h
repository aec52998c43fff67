// Depth from normals.
//
// Let v = (-x, -y, 1) for a pinhole camera, at (x, y) on the image plane, and v = (0, 0, 1) for an
// orthographic one. A surface with normal n has
//   d log(depth) / d(x, y) = (n_x, n_y) / (n . v)   pinhole: the point is depth (x, y, -1)
//   d depth / d(x, y) = (n_x, n_y) / (n . v)        orthographic: the point is (x, y, -depth)
// because n is orthogonal to the derivatives of the point. [Durou 2020] J.-D. Durou et al.: A Comprehensive
// Introduction to Photometric 3D-reconstruction, §1.2.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace surflect::relief {

// Function over the pixels of a mask whose differences between neighbours are nearest to given ones.
// [Horn 1990] B. K. P. Horn: Height and Gradient from Shading, IJCV 5(1): the least-squares problem. [Braess
// 1995] D. Braess: Towards Algebraic Multigrid for Elliptic Problems of Second Order, Computing 55.

// Differences to the right-hand and the lower neighbour, each with a weight. Vectors have one entry per
// pixel, row 0 on top. Weights are not negative, and 0 if a neighbour is off the mask or off the image.
struct Differences {
  image::Mask mask;
  std::vector<double> right, down;
  std::vector<double> rightWeight, downWeight;

  explicit Differences(const image::Mask& where);
};

// Minimises sum_e w_e (f_j - f_i - d_e)^2  [Horn 1990]. Each piece of the mask that is connected by positive
// weights has mean 0; off the mask f is 0. Conjugate gradients, preconditioned by multigrid over aggregates
// of 2x2 pixels [Braess 1995], to 1e-9 of the first residual; O(pixels). Throws Cancelled.
std::vector<double> potentialOf(const Differences& differences, const Progress& progress);

// The gradient above; `n` in camera space, of any length. Angles between surface and ray are clamped to at
// least about six degrees. Zero for a zero normal.
Vec2<double> depthGradient(const capture::Lens& lens, const Vec2<double>& imagePoint, const Vec3<double>& n);

struct DepthMap {
  image::Mask mask;
  std::vector<double> depth;          // along the viewing axis, scene units; 0 off the mask
  std::vector<Vec2<double>> gradient; // of log depth or depth, see above
};

// Depth over the pixels of the mask from normals in acquisition space (3 channels, of any length). Where a
// normal is zero, it is unknown and the surface is interpolated smoothly. Each connected piece of the mask
// has the frontal plane's mean depth; for a pinhole camera, its geometric mean. Pixels without a ray are
// removed from the mask. Throws Cancelled.
DepthMap integrateNormals(const capture::Camera<AcquisitionSpace>& camera, const image::Image& normals,
                          const image::Mask& mask, const Progress& progress);

} // namespace surflect::relief
