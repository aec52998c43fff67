// Scripts for a model without one: the camera goes once round the object.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <span>
#include <string>

namespace surflect::scene {

struct TurntableObject {
  std::string model; // as the script names it
  const capture::Capture& rig;
  std::span<const Point3<AcquisitionSpace>> points; // on the object; not empty
  bool isBaked = false;                             // has its light: the script gives none
};

// Mean of the cameras' ups; an axis of the coordinates where one is near. y without cameras.
Vec3<double> upOf(const capture::Capture& rig);

// The shortest turn from y to a unit vector; by half a turn about z where that is -y.
Eigen::Quaterniond turnFromY(const Vec3<double>& up);

// Unit vector from the middle of an orbit to its camera [docs/script.md, camera.orbit]: azimuth 0 is on +z
// where the unit vector `up` is y, and grows towards +x; other ups turn it by the shortest turn, -y by half a
// turn about z.
Vec3<double> towardsOrbit(const Vec3<double>& up, Angle azimuth, Angle elevation);

// The camera of a turn-table: an orbit about the middle of the object's box, at a distance that shows the
// ball around it in all directions.
struct TurntableOrbit {
  Vec3<double> center, up; // up is upOf() the rig
  double ballRadius, distance;
  double fovDeg; // of the picture's shorter side
  double elevationDeg;
  double firstAzimuthDeg,
      lastAzimuthDeg; // all around, or to and fro within the sector that cameras have seen
  bool isWhole;
};
TurntableOrbit turntableOrbit(const TurntableObject& object);

// Text of a TOML script of 48 frames, commented. Up is the mean of the captured cameras' ups, and their
// median elevation is the camera's, which holds the object in its view. Lights, unless they are baked in, are
// three lamps among the captured lights' directions, which a white surface in the middle reflects as white.
std::string turntableScript(const TurntableObject& object);

// A script to start from: turntableScript, and for an object that bends a warp of each kind that needs no
// file, sized for the object. Each stands in comments, from which a "#" before its lines frees it.
std::string starterScript(const TurntableObject& object);

} // namespace surflect::scene
