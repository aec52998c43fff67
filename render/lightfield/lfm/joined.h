// Light field maps of several objects as those of one scene.  [Chen 2002, Fig. 1]
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/maps.h"
#include "srf/capture/camera.h"
#include "srf/capture/capture.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <span>

namespace surflect::lfm {

// Place of an object in a scene: scaled, then rotated, then moved.
//
// Symbols: q = position + scale rotation p, of a point p of the object.
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

// An object of a scene.
struct PlacedObject {
  size_t model = 0; // index of its maps
  Placement placement = {};
};

// Maps of all objects, in their order. Each model's maps are stored once, for any number of objects. Models
// have equal method, layout, samples and view sizes, and coding `bytes`. A model with fewer terms than others
// has no maps in the remaining terms. Bytes of means are rounded anew for the largest meanWhite of all
// models.
// Throws Error naming model and field if models do not fit together.
LightFieldMaps joined(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects);

// Bytes that joined() and the drawing of its maps take for the objects, about; without the models' maps.
double memoryOf(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects);

// Views of all objects, without lights. View V of object N, counted from 0, is called "N/V".
capture::Capture joinedRig(std::span<const capture::Capture* const> rigs,
                           std::span<const PlacedObject> objects);

} // namespace surflect::lfm
