// Vote of one view's silhouette on a point, or on all points of a ball.
//
// A view whose silhouette does not touch the image border sees the whole object. It votes on every point: a
// vote against points beside the image or behind the camera. A view that crops the object votes only on
// points inside its image.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <memory>
#include <optional>
#include <span>
#include <string>

namespace surflect::hull {

// Outline of a matte, where alpha crosses 1/2, as a distance field.

// Copies share their pixels.
class Outline {
public:
  // alpha: one channel, bilinear between pixel centres. The contour is straight within each square of four
  // centres; it has sub-pixel accuracy where alpha has values between 0 and 1. The image border is not part
  // of the outline.
  explicit Outline(const image::Image& alpha);

  int width() const { return distances_->width; }
  int height() const { return distances_->height; }
  // Mask of the pixels whose alpha is above 1/2.
  image::Mask mask() const;
  // Returns whether no pixel's alpha is above 1/2.
  bool isEmpty() const { return isEmpty_; }
  // Centre of mass of the pixels whose alpha is above 1/2; the image centre if there are none.
  capture::Pixel centroid() const { return centroid_; }

  // Returns whether a pixel on the image border is inside, so that the object may continue outside.
  bool isCropped() const { return isCropped_; }

  // Distance to the outline in pixels, positive inside; without an outline, width + height. Bilinear between
  // pixel centres, constant up to the border. Outside of the image, reduced by the distance to the image.
  double signedDistance(capture::Pixel pixel) const;

private:
  std::shared_ptr<const image::Image> distances_;
  capture::Pixel centroid_;
  bool isEmpty_ = true, isCropped_ = false;
};

struct SilhouetteView {
  std::string name;
  capture::Camera<AcquisitionSpace> camera;
  Outline outline;
};

// Size of a pixel at a point in front of the camera, scene units: depth / f; orthographic: 1 / f.
double pixelFootprint(const capture::Camera<AcquisitionSpace>& camera,
                      const Point3<AcquisitionSpace, double>& p);

// Signed distance from p to the cone of the silhouette, positive inside, converted from pixels to scene units
// by the footprint. Empty if the view does not vote on p; minus infinity behind the camera.
std::optional<double> coneDistance(const SilhouetteView& silhouetteView,
                                   const Point3<AcquisitionSpace, double>& p);

struct Ball {
  Point3<AcquisitionSpace, double> center;
  double radius = 0; // scene units
};

// Upper bound on the radius of a ball's image about the projection of its centre, in pixels. For a pinhole
// camera, centre c at depth z and |d| <= r,
//   |x(c + d) - x(c)| = |d_xy - x(c) d_z| / (z + d_z) <= r sqrt(1 + |x|^2) / (z - r).
// Distortion is linearised. Infinite if the ball touches the plane of the camera.
double projectedRadius(const capture::Camera<AcquisitionSpace>& camera, const Ball& ball);

// Conservative vote on the points of a ball. Outline distances count as exact to one pixel.
struct BallVote {
  bool votes = false;    // votes on every point of the ball
  bool mayAgree = false; // some points may be in the silhouette
  bool inside = false;   // votes against no point of the ball
  bool outside = false;  // votes against every point of the ball
};
BallVote voteOn(const SilhouetteView& silhouetteView, const Ball& ball);

// Point nearest to the rays through the silhouettes' centres of mass, by least squares. Throws Error if all
// rays are parallel to one line.
Point3<AcquisitionSpace, double> pointInView(std::span<const SilhouetteView> silhouetteViews);

// Number of views that must vote on a point of the object: half of those that vote on pointInView, and at
// least two. The cone of a single view is unbounded, and where few views vote, few can vote against.
size_t quorumOf(std::span<const SilhouetteView> silhouetteViews);

// Field of the hull: the smallest coneDistance of all views that vote, positive inside, clamped to +-limit.
// -limit if fewer views than the quorum vote.
double hullDistance(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                    const Point3<AcquisitionSpace, double>& p, double limit);

enum class Region { outside, inside, mixed };
// Region of the hull for a ball; mixed if unknown.
Region classify(std::span<const SilhouetteView> silhouetteViews, size_t quorum, const Ball& ball);

} // namespace surflect::hull
