#include "render/scene/camera_path.h"

#include "srf/capture/capture_keys.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>
#include <vector>

namespace surflect::scene {

namespace {

// Keys of a lens, beside its size.
constexpr std::array<std::string_view, 13> kLensKeys = {"camera_model",
                                                        "fl_x",
                                                        "fl_y",
                                                        "camera_angle_x",
                                                        "camera_angle_y",
                                                        "cx",
                                                        "cy",
                                                        "ortho_height",
                                                        "k1",
                                                        "k2",
                                                        "k3",
                                                        "p1",
                                                        "p2"};

// Numbers of a lens that move between keys.
constexpr std::array<double capture::Lens::*, 9> kMoving = {
    &capture::Lens::focalX,  &capture::Lens::focalY, &capture::Lens::centerX,
    &capture::Lens::centerY, &capture::Lens::k1,     &capture::Lens::k2,
    &capture::Lens::p1,      &capture::Lens::p2,     &capture::Lens::k3};

// Throws Error for a key that is none of a lens and none of `others`.
void requireKnown(const capture::Json& object, std::initializer_list<std::string_view> others) {
  std::vector<std::string_view> known(others);
  known.insert(known.end(), kLensKeys.begin(), kLensKeys.end());
  for (const auto& [key, value] : capture::objectOf(object).items())
    if (std::ranges::find(known, std::string_view(key)) == known.end())
      throw Error("unknown key" + didYouMean(key, known)).at(key);
}

// (1 - share) a + share b, which at both ends are exact.
double mix(double a, double b, double share) { return (1 - share) * a + share * b; }

} // namespace

CameraPath::CameraPath(const std::filesystem::path& path, const Vec3<double>& origin) {
  const std::string text = readFile(path, kLargestText);
  hash_ = surflect::contentHash(text);
  inFile(path, [&] {
    const capture::Json root = capture::parseJson(text);
    requireKnown(root, {"frames", "w", "h"});
    const capture::LensFields lens = capture::readLensFields(root);
    for (const char* side : {"w", "h"}) capture::required(root, side, capture::pixelCountOf);
    const capture::Json& frames = capture::required(root, "frames", capture::listOf);
    if (frames.empty()) throw Error::mismatch("one or more", "none").at("frames");
    capture::RoundedRotations rotations;
    for (size_t i = 0; i < frames.size(); ++i)
      atField(capture::element("frames", i), [&] {
        requireKnown(frames[i], {"frame", "transform_matrix"});
        const double frame = capture::required(frames[i], "frame", capture::numberOf);
        if (!keys_.empty() && !(frame > keys_.back().frame))
          throw Error::mismatch("more than " + numberText(keys_.back().frame) + ", that of the one before",
                                numberText(frame))
              .at("frame");
        const auto pose = capture::required(frames[i], "transform_matrix", [&](const capture::Json& value) {
          return capture::readPose(value, rotations);
        });
        const capture::LensFields fields = capture::inherit(capture::readLensFields(frames[i]), lens);
        // p_camera = R (p + origin) + t, as a place in the file is origin + p.
        const Mat3<double> rotation = pose.rotation();
        const capture::Lens keysLens = capture::lensOf(fields);
        if (!keys_.empty() && keysLens.model != keys_.front().camera.lens.model)
          throw Error::mismatch("that of the first key", "another").at("camera_model");
        keys_.push_back({frame, {keysLens, {rotation, pose.translation() + rotation * origin}}});
      });
  });
}

capture::Camera<ObjectSpace> CameraPath::at(double frame) const {
  const auto next = std::ranges::upper_bound(keys_, frame, {}, &Key::frame);
  if (next == keys_.begin()) return keys_.front().camera;
  const Key& from = *std::prev(next);
  if (next == keys_.end() || frame == from.frame) return from.camera;
  const Key& to = *next;
  const double share = (frame - from.frame) / (to.frame - from.frame);
  capture::Camera<ObjectSpace> camera = from.camera;
  for (const auto number : kMoving)
    camera.lens.*number = mix(camera.lens.*number, to.camera.lens.*number, share);
  const Vec3<double> position = (1 - share) * from.camera.center().raw() + share * to.camera.center().raw();
  const Mat3<double> rotation = Eigen::Quaterniond(from.camera.cameraFromWorld.rotation())
                                    .slerp(share, Eigen::Quaterniond(to.camera.cameraFromWorld.rotation()))
                                    .toRotationMatrix();
  camera.cameraFromWorld = {rotation, -(rotation * position)};
  return camera;
}

} // namespace surflect::scene
