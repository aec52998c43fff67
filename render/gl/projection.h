// Cameras of captures as matrices for OpenGL.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/math/space.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace surflect::gl {

struct DepthRange {
  double near = 1, far = 2; // along the camera's -z, 0 < near < far
};

// Range of depths of a box in camera space, with a margin for rounding. The far plane is at most 10^4 times
// as far as the near plane, so a box that reaches the camera loses its nearest part.
DepthRange depthRangeOf(const Eigen::AlignedBox3d& boxCamera);

// Matrix from camera space to clip space, for a context's conventions: a point is drawn at its
// capture::project(). Throws Error for a lens that is not a pinhole, and for one that distorts.
Eigen::Matrix4d clipFromCamera(const capture::Lens& lens, const DepthRange& range);

// Matrix from a camera's world to clip space, in float as shaders use it. The box holds everything that is
// drawn, and may be empty. Far from the world's origin float positions are coarse: centre the world on the
// object.
template <class World>
Eigen::Matrix4f clipFromWorld(const capture::Camera<World>& camera, const Eigen::AlignedBox3d& box) {
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
  cameraFromWorld.linear() = camera.cameraFromWorld.rotation();
  cameraFromWorld.translation() = camera.cameraFromWorld.translation();
  const DepthRange range = box.isEmpty() ? DepthRange{} : depthRangeOf(box.transformed(cameraFromWorld));
  return (clipFromCamera(camera.lens, range) * cameraFromWorld.matrix()).template cast<float>();
}

} // namespace surflect::gl
