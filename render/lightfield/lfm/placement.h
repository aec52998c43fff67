// Place of an object in a scene: scaled, then rotated, then moved.
//
// Symbols: q = position + scale rotation p, of a point p of the object.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "srf/capture/camera.h"
#include "surfel/math/space.h"

namespace surflect::lfm {

struct Placement {
  double scale = 1; // above 0
  Mat3<double> rotation = Mat3<double>::Identity();
  Vec3<double> position = {0, 0, 0}; // of the object's origin

  Point3<AcquisitionSpace> operator()(const Point3<AcquisitionSpace>& p) const {
    const Vec3<double> q = position + scale * (rotation * p.raw().cast<double>());
    return assume<Point3<AcquisitionSpace>>(Vec3<float>(q.cast<float>()));
  }

  VertexFrame operator()(const VertexFrame& frame) const {
    return {rotation * frame.x, rotation * frame.y, rotation * frame.z};
  }

  // The camera that sees the placed object as the given one sees the object.
  //   camera(p) = R p + t  becomes  scale camera(p) = R rotation^T (q - position) + scale t
  capture::Camera<AcquisitionSpace> operator()(const capture::Camera<AcquisitionSpace>& camera) const {
    const Mat3<double> turned = camera.cameraFromWorld.rotation() * rotation.transpose();
    capture::Camera<AcquisitionSpace> placed = camera;
    placed.cameraFromWorld = {turned, scale * camera.cameraFromWorld.translation() - turned * position};
    if (placed.lens.model == capture::Lens::Model::orthographic)
      placed.lens.focalX /= scale, placed.lens.focalY /= scale;
    return placed;
  }
};

} // namespace surflect::lfm
