// What one view's silhouette says about a point, or about all points of a ball.
//
// A view whose silhouette lies within its image sees all of the object, so it votes on every point, against
// those beside the image or behind the camera. One that crops the object votes only on points that its image
// contains.
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

// What a pixel covers at a point in front of the camera, scene units: depth / f; orthographic: 1 / f.
double pixelFootprint(const capture::Camera<AcquisitionSpace>& camera,
                      const Point3<AcquisitionSpace, double>& p);

// The distance of p to the cone of the silhouette, in scene units by the footprint, positive inside; empty
// without a vote, minus infinity behind the camera.
std::optional<double> coneDistance(const SilhouetteView& silhouetteView,
                                   const Point3<AcquisitionSpace, double>& p);

struct Ball {
  Point3<AcquisitionSpace, double> center;
  double radius = 0; // scene units
};

// How far a ball can reach in the picture, from the projection of its centre, pixels. For a pinhole, of the
// points c + d with |d| <= r: |x(c + d) - x(c)| = |d_xy - x(c) d_z| / (z + d_z) <= r sqrt(1 + |x|^2) / (z -
// r). A distortion is taken as linear within. Infinite where the ball touches the plane of the camera.
double projectedRadius(const capture::Camera<AcquisitionSpace>& camera, const Ball& ball);

// True of every point of a ball, or not known. Outline distances count as exact to one pixel.
struct BallVote {
  bool votes = false;    // on all of it
  bool mayAgree = false; // some of it may be in the silhouette
  bool inside = false;   // it votes against none of it
  bool outside = false;  // it votes against all of it
};
BallVote voteOn(const SilhouetteView& silhouetteView, const Ball& ball);

// The point nearest to the rays through the silhouettes' centres of mass, by least squares. Throws Error
// where all of them look along one line.
Point3<AcquisitionSpace, double> pointInView(std::span<const SilhouetteView> silhouetteViews);

// How many must vote on a point for it to be of the object: half of those that vote on pointInView, and two.
// (The cone of a single view has no end; where few look, few can say no.)
size_t quorumOf(std::span<const SilhouetteView> silhouetteViews);

// The hull's field: the least coneDistance of all that vote, positive inside, cut off at +-limit. Without a
// quorum it is -limit.
double hullDistance(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                    const Point3<AcquisitionSpace, double>& p, double limit);

enum class Region { outside, inside, mixed };
// Of the hull, in a ball: mixed where it is not sure.
Region classify(std::span<const SilhouetteView> silhouetteViews, size_t quorum, const Ball& ball);

} // namespace surflect::hull
