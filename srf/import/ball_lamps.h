// Lamps from photographs of a mirror ball, which stood where the object stands.
#pragma once

#include "srf/calibration/chrome_ball.h"
#include "srf/capture/camera.h"
#include "srf/import/lit_view.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace surflect::importers {

// Lamps by name, as places or directions in the world.
struct BallLamps {
  std::map<std::string, calibration::LampOfRays> lamps;
  std::vector<std::string> notes;
};

// Lamps by the pictures below a folder whose names fit a pattern with {camera} and {light}, of the named
// cameras. The ball's coverage in a camera is a picture named mask in the camera's folder, or named as the
// camera with _mask, -mask or .mask; without one, the alpha of its first picture. With two pinhole cameras or
// more, the ball's place and radius follow from its outlines, and places of near lamps can; otherwise
// directions alone. Throws Error, also for an outline that is more than 2 % of its radius off a ball's;
// throws Cancelled. Progress names the stage "mirror ball".
BallLamps lampsOfBall(const std::filesystem::path& folder, const std::string& pattern,
                      const std::map<std::string, capture::Camera<AcquisitionSpace>>& cameras,
                      const Progress& progress = {});

// Directions of the lamps of one view, in the natural order of the pictures of the ball in a folder. Throws
// Error as lampsOfBall() does; throws Cancelled.
std::vector<LightEntry> lampsOfBallInOneView(const std::filesystem::path& folder, const capture::Lens& lens,
                                             const Progress& progress = {});

} // namespace surflect::importers
