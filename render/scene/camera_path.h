// A camera's path from a file: poses and lenses at frames, as transforms.json has them.
#pragma once

#include "srf/capture/camera.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace surflect::scene {

class CameraPath {
public:
  // Reads JSON: the lens keys of transforms.json, which frames may override, and a list `frames` of
  // { frame, transform_matrix } in rising order, all of one camera model. `origin` is subtracted from
  // positions. Throws Error naming file and field; a misspelt key is answered with the nearest known one.
  explicit CameraPath(const std::filesystem::path& path, const Vec3<double>& origin = Vec3<double>::Zero());

  // Camera at a frame. Between keys, position and lens move linearly and the axes turn about one axis at a
  // constant speed (slerp); before the first key and after the last, the camera stands still.
  capture::Camera<ObjectSpace> at(double frame) const;

  uint64_t contentHash() const { return hash_; } // of the file

private:
  struct Key {
    double frame;
    capture::Camera<ObjectSpace> camera;
  };

  std::vector<Key> keys_; // at least one
  uint64_t hash_ = 0;
};

} // namespace surflect::scene
