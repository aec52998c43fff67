// What an importer finds in other people's files: a capture whose pictures still lie there.
#pragma once

#include "srf/capture/capture.h"
#include "srf/capture/rounded_rotations.h"

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Where a source's files lie, and whether they may lie elsewhere.
struct SourceFiles {
  std::filesystem::path root;
  bool allowOutside = false;

  // The file of a name written in the source, relative to the root; backslashes can stand for slashes. Empty
  // if there is none; throws Error if there is one out of the root (by links, too), unless that is allowed.
  std::optional<std::filesystem::path> find(std::string_view written) const;
  // The same, but throws Error if there is none.
  std::filesystem::path at(std::string_view written) const;
  // Throws Error if the file is out of the root, unless that is allowed.
  void check(const std::filesystem::path& file) const;
  // A file's path for messages: from the root, or from the folder that the root lies in.
  std::string shown(const std::filesystem::path& file) const;
};

struct Source {
  SourceFiles files;
  std::vector<std::filesystem::path> maskFolders; // those with masks by the pictures' names below the root
  capture::Capture capture; // its paths can be opened as they are; capture.file is empty
  std::set<std::filesystem::path>
      poorSilhouettes;            // pictures whose object no threshold tells, by the source's word
  bool strengthsUnknown = false;  // the lights' irradiance is 1 for all, and stands for nothing
  std::vector<std::string> notes; // what a user should know of how the files were understood
};

// Poses in computer vision's axes (x right, y down, z forwards), camera from world: x_camera = R x + t. The
// rounding of the rotation's digits is taken out, and counted. Throws Error for anything but a rigid motion.
Rigid<CameraSpace, AcquisitionSpace> poseFromVisionAxes(const Mat3<double>& rotation,
                                                        const Vec3<double>& translation,
                                                        capture::RoundedRotations& rotations);

// A camera of each picture, named after it without its extension where that tells them apart.
std::vector<std::string> namesOfPictures(const std::vector<std::filesystem::path>& pictures);

// Values of a lens that come from a file; throw Error.
double checkedFocalLength(double pixels);
double checkedCenter(double pixels);
int checkedPixelCount(double pixels);

} // namespace surflect::importers
