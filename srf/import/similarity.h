// Similarities between worlds of a source: that of its poses, and one whose places and units the user knows.
#pragma once

#include "srf/import/foreign_capture.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <span>
#include <string>

namespace surflect::importers {

// x -> scale rotation x + translation
struct Similarity {
  double scale = 1;
  Mat3<double> rotation = Mat3<double>::Identity();
  Vec3<double> translation = Vec3<double>::Zero();

  Vec3<double> operator()(const Vec3<double>& x) const { return scale * (rotation * x) + translation; }
};

// Pose of the same camera in the world that the similarity leads to; camera space is scaled with it. Throws
// Error if that is farther away than 1e12.
Rigid<CameraSpace, AcquisitionSpace> moved(const Rigid<CameraSpace, AcquisitionSpace>& cameraFromWorld,
                                           const Similarity& similarity);

// Similarity with the least sum of squared distances from `to` [Umeyama 1991, Eqs. 40 to 43]; #from = #to.
// Throws Error for fewer than three points, for points on a line, for places that fit a mirror image better,
// and if the root mean square distance exceeds a quarter of that of `to` from its mean.
Similarity similarityBetween(std::span<const Vec3<double>> from, std::span<const Vec3<double>> to);

// Brings poses to the world of a table of known places, "name x y z" lines: the name is a picture's, with or
// without extension, or the {camera} of `pattern`, unless that is empty. Notes say how well poses and places
// agree. Throws Error, also if the source states lights or a mesh, which would stay behind.
void moveToPlaces(ForeignCapture& source, const std::filesystem::path& table, const std::string& pattern);

} // namespace surflect::importers
