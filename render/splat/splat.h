// Projection of a surfel to a Gaussian on the screen.
//
// A surfel spreads coverage * exp(-(a^2 + b^2) / (2 s^2)) over its surface p + a u + b v, with s =
// kSigmaPerRadius * radius. Warps and lenses are locally affine in (a, b): Gaussians that sum to 1 on the
// surface at rest, and to 1/2 at its borders, still do so after warping and projection. The sum over splats
// is therefore the coverage of a pixel at any stretch and zoom.
//
// [Botsch 2005]  Botsch, Hornung, Zwicker, Kobbelt: High-Quality Surface Splatting on Today's GPUs (the wider
//                of reconstruction kernel and low-pass, instead of their convolution).
// [Zwicker 2001] Zwicker, Pfister, van Baar, Gross: EWA Volume Splatting (resampling filter = warped
//                reconstruction kernel + low-pass).
// [Zwicker 2004] Zwicker, Rasanen, Botsch, Dachsbacher, Pauly: Perspective Accurate Splatting (contours by
//                homographies).
//
// Depth is handled as "order": a number that grows away from the viewer and is affine over the image of a
// plane. Orthographic lens: the depth d along the viewing axis. Pinhole: -1/d.
#pragma once

#include "render/splat/footprint.h"
#include "srf/capture/camera.h"
#include "surfel/sampling.h"

#include <span>
#include <variant>

namespace surflect::splat {

// Attributes of a cloud that splatting uses; each span has one entry per surfel.
struct Splats {
  std::span<const Point3<ObjectSpace>> p;
  std::span<const Direction3<ObjectSpace>> u, v; // warped tangents
  std::span<const Handedness> handedness;
  std::span<const float> radius;   // radius at rest, acquisition units
  std::span<const float> coverage; // peak of the Gaussian at rest

  size_t size() const { return p.size(); }
};

// Spans over two clouds of the same surfels, which must outlive the result.
Splats splatsOf(const SurfelCloud& rest, const DeformedCloud& deformed);

struct SplatOptions {
  // Least standard deviation of a splat on the screen, in pixels; that of its colour weights is smaller by
  // sqrt 2. At 0.44 the area of a tiny splat depends least on its position within a pixel: by 2 %, compared
  // with 8 % at 0.4.
  double lowPass = 0.44;
  // False: the nearest layer of a pixel grows at most kLayerGrowths times, starting at the nearest end of any
  // depth interval. A growth adds all splats in front of the first splat that begins behind the layer. Once
  // the added splats fill the pixel, or no splat is left, the pixel shows only these, even if its layer
  // reaches further back. Other pixels are searched for layers.
  bool searchLayers = true;
  // True: pixels also keep the layers behind those that fill them, with alpha 0, for composites of a
  // translucent object.
  bool keepsHidden = false;
  double nearDepth = 0.0; // scene units; a pinhole camera draws no splat that comes nearer

  friend bool operator==(const SplatOptions&, const SplatOptions&) = default;
};

// Gaussian of a splat in (x, y, order), x and y in pixels. The splat is flat, so the covariance has rank two.
struct ScreenGaussian {
  Vec3<double> mean;
  Mat3<double> covariance;
};

// The Gaussian whose 1-sigma ellipse is the exact image of the circle a^2 + b^2 = s^2 around p, all of which
// must lie in front of the viewer. Lens distortion is approximated by its affine map at the ellipse's centre.
ScreenGaussian project(const capture::Lens& lens, const Point3<CameraSpace, double>& p,
                       const Direction3<CameraSpace, double>& u, const Direction3<CameraSpace, double>& v,
                       double s);

std::variant<Footprint, Rejection> footprintOf(const capture::Camera<ObjectSpace>& camera,
                                               const Splats& splats, size_t index,
                                               const SplatOptions& options);

// Depth along the viewing axis for an order.
inline double depthOfOrder(const capture::Lens& lens, double order) {
  return lens.model == capture::Lens::Model::orthographic ? order : -1 / order;
}

} // namespace surflect::splat
