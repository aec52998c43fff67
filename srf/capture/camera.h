// Lens models from space to pixels: pinhole with OpenCV's distortion, or orthographic.
//
// Pixel (i, j) covers [i, i+1) x [j, j+1), row 0 on top, so pixel centres are at +0.5. Camera axes are
// OpenGL's: x right, y up, looking along -z.
#pragma once

#include "surfel/math/space.h"

#include <limits>
#include <optional>

namespace surflect::capture {

struct Lens {
  enum class Model { pinhole, orthographic };

  Model model = Model::pinhole;
  int width = 0, height = 0;             // pixels
  double focalX = 1, focalY = 1;         // pixels; orthographic: pixels per scene unit
  double centerX = 0, centerY = 0;       // pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0; // on y-down normalised image coordinates
  double k3 = 0;

  bool distorts() const { return k1 != 0 || k2 != 0 || k3 != 0 || p1 != 0 || p2 != 0; }
  friend bool operator==(const Lens&, const Lens&) = default;
};

struct Pixel {
  double x = 0, y = 0;
};

// OpenCV's radial and tangential distortion of normalised image coordinates (x right, y down).
Vec2<double> distort(const Lens& lens, const Vec2<double>& undistorted);
// Derivative of distort() with respect to the undistorted coordinates.
Eigen::Matrix2d distortionJacobian(const Lens& lens, const Vec2<double>& undistorted);
// Inverse of distort() by Newton's method, to 1e-14; empty where the polynomial folds and has no inverse
// nearby.
std::optional<Vec2<double>> undistort(const Lens& lens, const Vec2<double>& distorted);

// Pixel position of a point. Empty if the point is not in front of a pinhole camera (depth along -z must be
// positive), or so far off the axis that the distortion's polynomial has folded back.
std::optional<Pixel> project(const Lens& lens, const Point3<CameraSpace, double>& p);

struct CameraRay {
  Point3<CameraSpace, double> origin;
  Direction3<CameraSpace, double> direction; // unit
};
// Ray through a pixel position; empty where undistort() is.
std::optional<CameraRay> rayThrough(const Lens& lens, Pixel pixel);

inline bool contains(const Lens& lens, Pixel pixel) {
  return pixel.x >= 0 && pixel.y >= 0 && pixel.x < lens.width && pixel.y < lens.height;
}

// Lens of the same view on a picture of another size in pixels.
Lens resized(Lens lens, int width, int height);

// A lens with its pose in a world.
template <class World> struct Camera {
  Lens lens;
  Rigid<CameraSpace, World> cameraFromWorld;

  // Position of the camera; meaningless for an orthographic one.
  Point3<World, double> center() const {
    return cameraFromWorld.inverse()(Point3<CameraSpace, double>(0, 0, 0));
  }
  std::optional<Pixel> project(const Point3<World, double>& p) const {
    return surflect::capture::project(lens, cameraFromWorld(p));
  }
};

// Camera::project for many points: pose and lens of an undistorted pinhole are combined in one matrix.
template <class World> class Projector {
public:
  explicit Projector(const Camera<World>& camera) : camera_(camera) {
    const Lens& lens = camera.lens;
    if (lens.model != Lens::Model::pinhole || lens.distorts()) return;
    Mat3<double> pixelFromCamera; // scaled by the depth
    pixelFromCamera << lens.focalX, 0, -lens.centerX, 0, -lens.focalY, -lens.centerY, 0, 0, -1;
    matrix_ = pixelFromCamera * camera.cameraFromWorld.rotation();
    offset_ = pixelFromCamera * camera.cameraFromWorld.translation();
    isPlain_ = true;
  }

  std::optional<Pixel> operator()(const Point3<World, double>& p) const {
    if (!isPlain_) return camera_.project(p);
    const Vec3<double> q = matrix_ * p.raw() + offset_;
    if (!(q[2] > 0)) return std::nullopt;
    const double scale = 1 / q[2];
    return Pixel{scale * q[0], scale * q[1]};
  }

private:
  Camera<World> camera_;
  Mat3<double> matrix_;
  Vec3<double> offset_;
  bool isPlain_ = false;
};

// Point where rays meet, or their common direction for an orthographic camera or a distant light.
template <class World> class Viewpoint {
public:
  explicit Viewpoint(const Camera<World>& camera)
      : isDistant_(camera.lens.model == Lens::Model::orthographic), center_(camera.center()),
        backwards_(camera.cameraFromWorld.inverse()(Direction3<CameraSpace, double>(0, 0, 1))) {}
  // A position, or for a distant viewpoint the unit direction towards it.
  Viewpoint(const Vec3<double>& place, bool isDistant)
      : isDistant_(isDistant), center_(assume<Point3<World, double>>(place)),
        backwards_(assume<Direction3<World, double>>(place)) {}

  // Unit direction from a point towards the viewer.
  Direction3<World, double> towards(const Point3<World, double>& p) const {
    return isDistant_ ? backwards_ : normalized(center_ - p);
  }
  double distance(const Point3<World, double>& p) const {
    return isDistant_ ? std::numeric_limits<double>::infinity() : length(center_ - p);
  }
  bool isDistant() const { return isDistant_; }
  // Position, or for a distant viewpoint the unit direction towards it.
  Vec3<double> place() const { return isDistant_ ? backwards_.raw() : center_.raw(); }

private:
  bool isDistant_;
  Point3<World, double> center_;
  Direction3<World, double> backwards_;
};

} // namespace surflect::capture
