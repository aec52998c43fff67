// Result of reading another format: a capture whose pictures are still in the source.
#pragma once

#include "srf/capture/capture.h"
#include "srf/capture/capture_keys.h"

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Files of a source, and whether they may lie outside of its root.
struct SourceFiles {
  std::filesystem::path root;
  bool allowOutside = false;

  // File by the name written in the source, relative to the root; backslashes may stand for slashes. Empty if
  // it does not exist; throws Error if it is outside of the root, also by links, unless allowed.
  std::optional<std::filesystem::path> find(std::string_view written) const;
  // As find(), but throws Error if the file does not exist.
  std::filesystem::path at(std::string_view written) const;
  // Throws Error if the file is outside of the root, unless allowed.
  void check(const std::filesystem::path& file) const;
  // Path of a file for messages: relative to the root, or to the root's parent.
  std::string shown(const std::filesystem::path& file) const;
};

struct ForeignCapture {
  SourceFiles files;
  std::vector<std::filesystem::path> maskFolders; // folders of masks named like the pictures below the root
  capture::Capture capture;                       // paths can be opened as they are; capture.file is empty
  std::set<std::filesystem::path>
      poorSilhouettes; // pictures whose object cannot be segmented by threshold, as the source states
  bool strengthsUnknown = false;  // irradiance 1 of all lights is a placeholder
  std::vector<std::string> notes; // for the user: how the files were understood
};

// Pose in computer vision's axes (x right, y down, z forwards), camera from world: x_camera = R x + t.
// Rounding of the rotation's digits is removed, and counted. Throws Error unless it is a rigid motion.
Rigid<CameraSpace, AcquisitionSpace> poseFromVisionAxes(const Mat3<double>& rotation,
                                                        const Vec3<double>& translation,
                                                        capture::RoundedRotations& rotations);

// Names of the pictures' cameras: the pictures' names, without extension if that keeps them distinct.
std::vector<std::string> namesOfPictures(const std::vector<std::filesystem::path>& pictures);

// Checks of lens values from a file; throw Error.
double checkedFocalLength(double pixels);
double checkedCenter(double pixels);
int checkedPixelCount(double pixels);

} // namespace surflect::importers
