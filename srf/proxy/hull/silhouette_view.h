// Vote of one view's silhouette on a point, or on all points of a ball.
//
// A view whose silhouette does not touch the image border sees the whole object. It votes on every point: a
// vote against points beside the image or behind the camera. A view that crops the object votes only on
// points inside its image.
#pragma once

#include "srf/capture/camera.h"
#include "srf/proxy/hull/outline.h"

#include <optional>
#include <span>
#include <string>

namespace surflect::hull {

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
