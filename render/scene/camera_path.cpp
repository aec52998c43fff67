#include "render/scene/camera_path.h"

#include "srf/capture/capture_keys.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace surflect::scene {

namespace {

constexpr std::array<std::string_view, 9> kPathKeys = {
    "frames", "w", "h", "fl_x", "fl_y", "cx", "cy", "camera_angle_x", "camera_angle_y"};
constexpr std::array<std::string_view, 8> kKeyKeys = {
    "frame", "transform_matrix", "fl_x", "fl_y", "cx", "cy", "camera_angle_x", "camera_angle_y"};

void requireKnown(const capture::Json& object, std::span<const std::string_view> known) {
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
    requireKnown(root, kPathKeys);
    const capture::LensFields lens = capture::readLensFields(root);
    for (const char* side : {"w", "h"}) capture::required(root, side, capture::pixelCountOf);
    const capture::Json& frames = capture::required(root, "frames", capture::listOf);
    if (frames.empty()) throw Error::mismatch("one or more", "none").at("frames");
    capture::RoundedRotations rotations;
    for (size_t i = 0; i < frames.size(); ++i)
      atField(capture::element("frames", i), [&] {
        requireKnown(frames[i], kKeyKeys);
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
        keys_.push_back(
            {frame, {capture::lensOf(fields), {rotation, pose.translation() + rotation * origin}}});
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
  const capture::Lens& last = to.camera.lens;
  camera.lens.focalX = mix(camera.lens.focalX, last.focalX, share);
  camera.lens.focalY = mix(camera.lens.focalY, last.focalY, share);
  camera.lens.centerX = mix(camera.lens.centerX, last.centerX, share);
  camera.lens.centerY = mix(camera.lens.centerY, last.centerY, share);
  const Vec3<double> position = (1 - share) * from.camera.center().raw() + share * to.camera.center().raw();
  const Mat3<double> rotation = Eigen::Quaterniond(from.camera.cameraFromWorld.rotation())
                                    .slerp(share, Eigen::Quaterniond(to.camera.cameraFromWorld.rotation()))
                                    .toRotationMatrix();
  camera.cameraFromWorld = {rotation, -(rotation * position)};
  return camera;
}

} // namespace surflect::scene
