#include "srf/capture/capture.h"

#include "srf/capture/capture_files.h"
#include "srf/capture/capture_keys.h"
#include "srf/capture/counted.h"
#include "srf/capture/lens_fields.h"
#include "srf/capture/limits.h"
#include "srf/capture/rounded_rotations.h"
#include "srf/capture/shallow_json.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/nearest_name.h"
#include "surfel/math/angle.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

namespace surflect::capture {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

// ---------------------------------------------------------------------------------------------------------
// JSON values, and errors that say where.

// Adds the field to an Error that leaves the work.
template <class Work> auto within(const std::string& field, Work work) {
  try {
    return work();
  } catch (Error& e) {
    throw std::move(e).at(field);
  }
}

std::string element(const std::string& list, size_t index) {
  return std::string(list).append("[").append(std::to_string(index)).append("]");
}

std::string shown(const Json& value) {
  if (value.is_null()) return "nothing";
  if (value.is_object()) return "an object";
  if (value.is_array()) return "a list of " + std::to_string(value.size());
  const std::string text = value.dump();
  return text.size() <= 60 ? text : text.substr(0, 57) + "...";
}

// A null stands for a missing field, which required() reports with the parser's own expectation.
template <class Parse> auto required(const Json& object, const char* key, Parse parse) {
  static const Json nothing;
  const auto found = object.find(key);
  return within(key, [&] { return parse(found == object.end() ? nothing : *found); });
}

template <class Parse>
auto optional(const Json& object, const char* key, Parse parse) -> std::optional<decltype(parse(object))> {
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return std::nullopt;
  return within(key, [&] { return parse(*found); });
}

const Json& objectOf(const Json& value) {
  if (!value.is_object()) throw Error::mismatch("an object", shown(value));
  return value;
}

const Json& listOf(const Json& value) {
  if (!value.is_array()) throw Error::mismatch("a list", shown(value));
  return value;
}

double number(const Json& value) {
  if (!value.is_number()) throw Error::mismatch("a number", shown(value));
  return value.get<double>();
}

// Positive strength, length or time; its bounds keep quotients finite.
double positive(const Json& value) {
  const double x = value.is_number() ? value.get<double>() : 0;
  if (!(x >= 1e-12 && x <= 1e12)) throw Error::mismatch("a number above 0 (1e-12 to 1e12)", shown(value));
  return x;
}

// Coordinate of a position or principal point.
double coordinate(const Json& value) {
  const double x = number(value);
  if (!(std::abs(x) <= kFarthest)) throw Error::mismatch("a number from -1e12 to 1e12", shown(value));
  return x;
}

constexpr double kMostPixels = 1 << 16;

int pixelCount(const Json& value) {
  const double x = value.is_number() ? value.get<double>() : 0; // some exporters write 800.0
  if (!(x >= 1 && x <= kMostPixels && x == std::floor(x)))
    throw Error::mismatch("a whole number from 1 to " + numberText(kMostPixels), shown(value));
  return static_cast<int>(x);
}

std::string text(const Json& value) {
  if (!value.is_string()) throw Error::mismatch("a string", shown(value));
  return value.get<std::string>();
}

Vec3<double> triple(const Json& value) {
  const bool three = value.is_array() && value.size() == 3 &&
                     std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number(); });
  if (!three)
    throw Error::mismatch("three numbers", value.is_array() ? value.dump().substr(0, 60) : shown(value));
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

Vec3<double> boundedTriple(const Json& value) {
  const Vec3<double> v = triple(value);
  if (!(v.cwiseAbs().maxCoeff() <= kFarthest))
    throw Error::mismatch("three numbers from -1e12 to 1e12", value.dump().substr(0, 60));
  return v;
}

Point3<AcquisitionSpace, double> place(const Json& value) {
  return assume<Point3<AcquisitionSpace, double>>(boundedTriple(value));
}

// Compared as floats, like the writer's values.
Rgb strengths(const Json& value) {
  const Vec3<float> rgb = triple(value).cast<float>();
  if (!(rgb.minCoeff() >= kLeastStrength && rgb.maxCoeff() <= kMostStrength))
    throw Error::mismatch("three numbers above 0 (1e-12 to 1e12)", value.dump().substr(0, 60));
  return {rgb[0], rgb[1], rgb[2]};
}

template <class Choice>
Choice oneOf(const Json& value, std::initializer_list<std::pair<const char*, Choice>> choices) {
  std::string expected;
  for (const auto& [name, choice] : choices) {
    if (value == name) return choice;
    expected += (expected.empty() ? "" : " or ") + std::string(name);
  }
  throw Error::mismatch(expected, shown(value));
}

// ---------------------------------------------------------------------------------------------------------
// Keys.

// Returns whether a value means that its key does not apply: null, false, 0, "none", one of the words, or a
// list of such values.
bool saysNothing(const Json& value, std::string_view words) {
  if (value.is_boolean()) return !value.get<bool>();
  if (value.is_number()) return value.get<double>() == 0;
  if (value.is_array())
    return std::all_of(value.begin(), value.end(), [&](const Json& v) { return saysNothing(v, words); });
  if (!value.is_string()) return value.empty();
  const std::string word = lowerCase(value.get<std::string>());
  return word.empty() || word == "none" ||
         (" " + std::string(words) + " ").find(" " + word + " ") != std::string::npos;
}

// Returns whether the start or end of a camera's motion equals its pose.
bool standsStill(const Json& object, std::string_view key, const Json& value) {
  const auto pose = object.find("transform_matrix");
  return key.starts_with("transform_matrix_") && pose != object.end() && *pose == value;
}

// Counts unknown keys. Throws Error for one that would change the meaning and is not supported.
void checkKeys(const Json& object, KeyPlace place, UnknownKeys& unknown) {
  for (const auto& [key, value] : object.items()) {
    const KeyRule rule = keyRule(key, place);
    if (rule.use == KeyUse::unknown) unknown.add(key, place);
    if (rule.use != KeyUse::unsupported || saysNothing(value, rule.neutral) ||
        standsStill(object, key, value))
      continue;
    const std::string whole = value.dump();
    throw Error::mismatch(rule.expected, whole.size() <= 60 ? whole : shown(value)).at(key);
  }
}

// ---------------------------------------------------------------------------------------------------------
// Response curves.

std::array<float, image::Response::codes> readCurve(const Json& value) {
  const std::string expected = std::to_string(image::Response::codes) + " exposures";
  if (!value.is_array() || value.size() != image::Response::codes)
    throw Error::mismatch(expected, shown(value));
  std::array<float, image::Response::codes> curve;
  float last = 0;
  for (size_t z = 0; z < curve.size(); ++z)
    within(element("", z), [&] {
      curve[z] = static_cast<float>(number(value[z]));
      if (!(curve[z] >= last) || !std::isfinite(curve[z]))
        throw Error::mismatch("a number not below the one before it", shown(value[z]));
      last = curve[z];
    });
  if (!(last > 0)) throw Error::mismatch("an exposure above 0 at the end", "0");
  return curve;
}

image::Response readResponse(const Json& value) {
  const Json& curves = objectOf(value);
  return {
      {required(curves, "r", readCurve), required(curves, "g", readCurve), required(curves, "b", readCurve)}};
}

// ---------------------------------------------------------------------------------------------------------
// Names.

// Lights of a capture, found by name or by value.
class LightList {
public:
  // Throws Error if the name exists.
  size_t add(Light light) {
    const size_t index = lights_.size();
    if (!byName_.try_emplace(light.name, index).second)
      throw Error("a second light is called " + light.name).at("name");
    if (const auto* point = std::get_if<PointLight>(&light.kind)) byPoint_.try_emplace(keyOf(*point), index);
    lights_.push_back(std::move(light));
    return index;
  }

  size_t named(const Json& value) const {
    const std::string name = text(value);
    if (const auto known = byName_.find(name); known != byName_.end()) return known->second;
    if (lights_.empty()) throw Error::mismatch("no light, as the capture lists none", shown(value));
    std::vector<std::string_view> known;
    for (const Light& light : lights_) known.push_back(light.name);
    throw Error::mismatch("a light of the list (nearest: " + std::string(nearestName(name, known)) + ")",
                          shown(value));
  }

  // First light equal to this point light.
  std::optional<size_t> find(const PointLight& light) const {
    const auto known = byPoint_.find(keyOf(light));
    return known == byPoint_.end() ? std::nullopt : std::optional(known->second);
  }

  std::vector<Light> take() && { return std::move(lights_); }

private:
  using PointKey = std::array<double, 6>; // position and intensity

  static PointKey keyOf(const PointLight& light) {
    const auto& [r, g, b] = light.intensity;
    return {light.position.x(), light.position.y(), light.position.z(), r, g, b};
  }

  std::vector<Light> lights_;
  std::map<std::string, size_t> byName_;
  std::map<PointKey, size_t> byPoint_;
};

// ---------------------------------------------------------------------------------------------------------
// Lights.

DirectionalLight readDirectional(const Json& light) {
  const Vec3<double> towards = required(light, "direction", [](const Json& value) {
    const Vec3<double> direction = triple(value);
    const double found = direction.norm();
    if (!(std::abs(found - 1) <= 1e-3)) throw Error::mismatch("a unit vector", "length " + numberText(found));
    return Vec3<double>(std::abs(found - 1) > 1e-14 ? direction / found : direction);
  });
  return {assume<Direction3<AcquisitionSpace, double>>(towards), required(light, "irradiance", strengths),
          optional(light, "irradiance_gradient", boundedTriple).value_or(Vec3<double>::Zero())};
}

PointLight readPoint(const Json& light) {
  return {required(light, "position", place), required(light, "intensity", strengths)};
}

Light readLight(const Json& value) {
  const Json& object = objectOf(value);
  Light light;
  light.name = required(object, "name", text);
  light.identity = optional(object, "cluster", text).value_or(light.name);
  const bool directional = required(object, "type", [](const Json& type) {
    return oneOf<bool>(type, {{"directional", true}, {"point", false}});
  });
  if (directional)
    light.kind = readDirectional(object);
  else
    light.kind = readPoint(object);
  return light;
}

// Light that relighting sets write into every frame; equal ones are one light.
std::optional<size_t> frameLight(LightList& lights, const Json& frame, size_t frameIndex) {
  const auto position = optional(frame, "pl_pos", place);
  if (!position) return std::nullopt;
  const auto intensity = optional(frame, "pl_intensity", [](const Json& value) {
    return value.is_number() ? static_cast<float>(positive(value)) * Rgb{1, 1, 1} : strengths(value);
  });
  const PointLight point{*position, intensity.value_or(Rgb{1, 1, 1})};
  if (const auto known = lights.find(point)) return known;
  const std::string name = element("pl_pos", frameIndex);
  return lights.add({name, name, point});
}

// ---------------------------------------------------------------------------------------------------------
// Lenses.

double fieldOfView(const Json& value) {
  const double angle = positive(value);
  if (!(angle < std::numbers::pi)) throw Error::mismatch("radians below pi", shown(value));
  return angle;
}

double fieldOfViewDegrees(const Json& value) {
  const double angle = positive(value);
  if (!(angle < 180)) throw Error::mismatch("degrees below 180", shown(value));
  return Angle::fromDegrees(angle).radians();
}

// Angle in NeRF's radians or, under another key, instant-ngp's degrees.
std::optional<double> angleOf(const Json& object, const char* inRadians, const char* inDegrees) {
  const auto radians = optional(object, inRadians, fieldOfView),
             degrees = optional(object, inDegrees, fieldOfViewDegrees);
  if (radians && degrees && !sameAngle(*radians, *degrees))
    throw Error::mismatch("about " + numberText(Angle::fromRadians(*radians).degrees()) + ", as " +
                              inRadians + " says",
                          shown(object[inDegrees]))
        .at(inDegrees);
  return radians ? radians : degrees;
}

Lens::Model lensModel(const Json& value) {
  using enum Lens::Model; // nerfstudio's names are COLMAP's
  return oneOf<Lens::Model>(value, {{"pinhole", pinhole},
                                    {"orthographic", orthographic},
                                    {"PINHOLE", pinhole},
                                    {"SIMPLE_PINHOLE", pinhole},
                                    {"SIMPLE_RADIAL", pinhole},
                                    {"RADIAL", pinhole},
                                    {"OPENCV", pinhole}});
}

// Fills in a missing size from the picture. A stated size may differ from the picture's if the shape is
// equal, because pictures may be reduced copies.
LensFields withSize(LensFields lens, image::PictureSize picture) {
  const double shape = static_cast<double>(picture.width) / picture.height;
  const auto pixels = [](double x) { return static_cast<int>(std::clamp(std::round(x), 1., kMostPixels)); };
  if (!lens.width) lens.width = lens.height ? pixels(*lens.height * shape) : picture.width;
  if (!lens.height) lens.height = pixels(*lens.width / shape);
  return lens;
}

LensFields readLensFields(const Json& object) {
  return {.model = optional(object, "camera_model", lensModel),
          .width = optional(object, "w", pixelCount),
          .height = optional(object, "h", pixelCount),
          .focalX = optional(object, "fl_x", positive),
          .focalY = optional(object, "fl_y", positive),
          .angleX = angleOf(object, "camera_angle_x", "x_fov"),
          .angleY = angleOf(object, "camera_angle_y", "y_fov"),
          .orthoHeight = optional(object, "ortho_height", positive),
          .centerX = optional(object, "cx", coordinate),
          .centerY = optional(object, "cy", coordinate),
          .k1 = optional(object, "k1", number),
          .k2 = optional(object, "k2", number),
          .p1 = optional(object, "p1", number),
          .p2 = optional(object, "p2", number)};
}

// ---------------------------------------------------------------------------------------------------------
// Poses.

using Pose = Rigid<CameraSpace, AcquisitionSpace>;

// Camera-to-world matrix of the file, with the rotation orthonormalised.
Pose readPose(const Json& value, RoundedRotations& rotations) {
  Eigen::Matrix4d m;
  const auto fourOf = [](const Json& list, const char* expected) -> const Json& {
    if (!list.is_array() || list.size() != 4) throw Error::mismatch(expected, shown(list));
    return list;
  };
  for (size_t row = 0; row < 4; ++row) {
    const Json& rows = fourOf(value, "four rows of four numbers");
    within(element("", row), [&] {
      const Json& columns = fourOf(rows[row], "four numbers");
      for (size_t c = 0; c < 4; ++c)
        m(static_cast<int>(row), static_cast<int>(c)) =
            within(element("", c), [&] { return coordinate(columns[c]); });
    });
  }
  if (!(m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).isZero(1e-6))
    throw Error::mismatch("last row 0 0 0 1", shown(value[3])).at("[3]");
  const Mat3<double> rotation = rotations.nearestUnscaled(m.topLeftCorner<3, 3>());
  return Rigid<AcquisitionSpace, CameraSpace>(rotation, m.topRightCorner<3, 1>()).inverse();
}

// Key of a view: the camera's name, if any, then the numbers of lens and pose.
using ViewKey = std::pair<std::optional<std::string>, std::array<double, 23>>;

ViewKey keyOf(const std::optional<std::string>& name, const Lens& lens, const Pose& pose) {
  ViewKey key{name, {}};
  Eigen::Map<Eigen::Matrix<double, 23, 1>>(key.second.data()) << static_cast<double>(lens.model), lens.width,
      lens.height, lens.focalX, lens.focalY, lens.centerX, lens.centerY, lens.k1, lens.k2, lens.p1, lens.p2,
      pose.rotation().reshaped(), pose.translation();
  return key;
}

// ---------------------------------------------------------------------------------------------------------
// Frames.

class CaptureReader {
public:
  CaptureReader(const fs::path& file, PathRule paths) : files_(file.parent_path(), paths) {
    capture_.file = file;
  }

  Capture read(const Json& root) && {
    checkKeys(objectOf(root), KeyPlace::capture, unknownKeys_);
    capture_.colorSpace = optional(root, "color_space", [](const Json& value) {
      return oneOf<ColorSpace>(value, {{"linear", ColorSpace::linear}, {"srgb", ColorSpace::srgb}});
    });
    capture_.response = optional(root, "response", readResponse);
    if (capture_.colorSpace && capture_.response)
      throw Error::mismatch("either color_space or response", "both").at("response");
    capture_.geometry = optional(root, "geometry", [this](const Json& v) { return fileAt(v); }).value_or("");
    capture_.origin = optional(root, "origin", boundedTriple).value_or(Vec3<double>::Zero());
    readCalibration(root);
    if (const auto lights = root.find("lights"); lights != root.end())
      within("lights", [&] { listOf(*lights); });
    readEach(root, "lights", [this](const Json& light, size_t) {
      checkKeys(objectOf(light), KeyPlace::light, unknownKeys_);
      lights_.add(readLight(light));
    });

    const LensFields shared = readLensFields(root);
    if (required(root, "frames", listOf).empty()) throw Error("the list is empty").at("frames");
    readEach(root, "frames",
             [&](const Json& frame, size_t index) { addFrame(objectOf(frame), index, shared); });
    capture_.lights = std::move(lights_).take();
    takeNotes();
    return std::move(capture_);
  }

private:
  template <class Read> static void readEach(const Json& root, const char* key, Read read) {
    const auto list = root.find(key);
    for (size_t i = 0; list != root.end() && i < list->size(); ++i)
      within(element(key, i), [&] { read((*list)[i], i); });
  }

  // Reads notes for people; other content under this name is ignored.
  void readCalibration(const Json& root) {
    const auto notes = root.find("calibration");
    if (notes == root.end() || !notes->is_object()) return;
    for (const auto& [name, note] : notes->items())
      if (note.is_string()) capture_.calibration[name] = note;
  }

  // Normalised path inside the capture's folder. Backslashes are Windows' slashes, unless a file of that very
  // name exists.
  fs::path pathOf(const Json& value) {
    std::string written = text(value);
    const bool isPath = !written.empty() && written.find('\0') == std::string::npos;
    if (isPath && written.find('\\') != std::string::npos && !files_.isThere(written))
      std::replace(written.begin(), written.end(), '\\', '/');
    const fs::path path = fs::path(written).lexically_normal();
    if (isPath && files_.mayName(path)) return path;
    throw Error::mismatch(
        std::string("a path inside the capture's folder") + (isPath ? CaptureFiles::hint : ""), shown(value));
  }

  fs::path fileAt(const Json& value) {
    const fs::path path = pathOf(value);
    if (!files_.isThere(path)) throw Error::mismatch("a file", "none at " + path.string());
    return path;
  }

  // Picture by name; Blender's exporters leave out the extension.
  fs::path pictureAt(const Json& value) {
    const fs::path path = pathOf(value);
    for (const char* extension : {"", ".png", ".jpg", ".exr"})
      if (const fs::path tried = path.string() + extension; files_.isThere(tried)) return tried;
    throw Error::mismatch("a picture (also tried .png, .jpg, .exr)", "none at " + path.string());
  }

  void addFrame(const Json& json, size_t index, const LensFields& shared) {
    checkKeys(json, KeyPlace::frame, unknownKeys_);
    checkTime(json);
    Frame frame;
    frame.picture = required(json, "file_path", [this](const Json& v) { return pictureAt(v); });
    frame.layer = optional(json, "layer", text).value_or("");
    frame.alphaLayer = optional(json, "alpha_layer", text).value_or("");
    frame.exposure = optional(json, "exposure", positive).value_or(1);
    frame.mask = optional(json, "mask_path", [this](const Json& v) { return fileAt(v); }).value_or("");
    frame.split = optional(json, "split", [](const Json& v) {
                    return oneOf<Split>(v, {{"train", Split::train}, {"test", Split::test}});
                  }).value_or(Split::train);
    frame.light = optional(json, "light", [this](const Json& v) { return lights_.named(v); });
    if (!frame.light) frame.light = frameLight(lights_, json, index);

    LensFields lens = inherit(readLensFields(json), shared);
    const bool sizeIsStated = lens.width || lens.height;
    if (!lens.width || !lens.height) lens = withSize(lens, files_.sizeOf(frame.picture));
    const Camera<AcquisitionSpace> camera{
        lensOf(lens),
        required(json, "transform_matrix", [this](const Json& v) { return readPose(v, rotations_); })};
    checkFocalLengths(lens, camera.lens, sizeIsStated);
    checkAgainstOthers(frame);
    addToView(std::move(frame), optional(json, "camera", text), camera);
  }

  void checkTime(const Json& json) {
    const auto time = optional(json, "time", number);
    if (time && capture_.time && *time != *capture_.time)
      throw Error::mismatch(
          numberText(*capture_.time) +
              ", as in the frames before: the frames are of several times, a model shows one",
          shown(json["time"]))
          .at("time");
    if (time) capture_.time = time;
  }

  // Number of occurrences of something that a note reports, and the first occurrence.
  struct Finding {
    size_t count = 0;
    std::string first = {};

    void add(const std::string& found) {
      if (++count == 1) first = found;
    }
  };

  // Checks angles against focal lengths. Blender's exporters write angles of the sensor, whatever part of it
  // the picture shows, so lengths count. Throws Error if an angle gives another focal length, and the picture
  // size of the stated one is unknown.
  void checkFocalLengths(const LensFields& fields, const Lens& lens, bool sizeIsStated) {
    if (lens.model == Lens::Model::orthographic) return;
    const auto check = [&](const std::string& axis, std::optional<double> focal, std::optional<double> angle,
                           int size) {
      const auto other = otherFocalLength(focal, angle, size);
      const std::string anglesOfAxis = "camera_angle_" + axis + " (or " + axis + "_fov)";
      if (other && !sizeIsStated)
        throw Error::mismatch("about " + numberText(*other) + ", as " + anglesOfAxis + " says, or w and h",
                              numberText(*focal))
            .at("fl_" + axis);
      if (other)
        otherAngles_.add("fl_" + axis + " is " + numberText(*focal) + ", " + anglesOfAxis + " would be " +
                         numberText(*other));
    };
    check("x", fields.focalX, fields.angleX, lens.width);
    check("y", fields.focalY, fields.angleY, lens.height);
    if (!fields.focalY && std::abs(lens.focalY - lens.focalX) > 0.01 * lens.focalX)
      notSquare_.add(numberText(lens.focalX) + " and " + numberText(lens.focalY));
  }

  static std::string shownPath(const fs::path& path) { return path.empty() ? "none" : path.string(); }

  // Adds a frame to its view, as a photograph, or as a further exposure of the photograph of that light and
  // split. A view may have several test photographs. A second training photograph becomes a view of its own,
  // as if taken by another camera. Frames without a camera's name share a view if pose and lens agree.
  void addToView(Frame frame, const std::optional<std::string>& name,
                 const Camera<AcquisitionSpace>& camera) {
    std::vector<size_t>& views = views_[keyOf(name, camera.lens, camera.cameraFromWorld)];
    const auto addView = [&] {
      views.push_back(capture_.views.size());
      capture_.views.push_back({name ? *name : fs::path(frame.picture).replace_extension().string(), camera});
    };
    if (views.empty()) addView();
    const size_t next = capture_.frames.size();
    const auto [found, isNew] = shots_.try_emplace({views[0], frame.light, frame.split}, Shot{0, next});
    Shot& shot = found->second;
    if (!isNew) {
      Frame& last = capture_.frames[shot.frame];
      const auto hasExposure = [&](const auto& e) { return e.exposure == frame.exposure; };
      if (!hasExposure(last) && std::ranges::none_of(last.further, hasExposure))
        return addExposure(last, std::move(frame));
      if (frame.split == Split::train) {
        if (isListed(last, frame)) {
          ++listedTwice_;
          return;
        }
        repeated_.add(frame.picture.string() + " that of " + last.picture.string());
        if (++shot.copy == views.size()) addView();
      }
      shot.frame = next;
    }
    frame.view = views[shot.copy];
    capture_.frames.push_back(std::move(frame));
  }

  // Returns whether the bracket already has this picture.
  static bool isListed(const Frame& bracket, const Frame& frame) {
    const auto isSame = [&](const auto& e) {
      return e.exposure == frame.exposure && e.picture == frame.picture && e.layer == frame.layer &&
             e.alphaLayer == frame.alphaLayer;
    };
    return bracket.mask == frame.mask && (isSame(bracket) || std::ranges::any_of(bracket.further, isSame));
  }

  static void addExposure(Frame& bracket, Frame frame) {
    if (bracket.mask != frame.mask)
      throw Error::mismatch("that of the other exposures, " + shownPath(bracket.mask), shownPath(frame.mask))
          .at("mask_path");
    bracket.further.push_back(
        {std::move(frame.picture), std::move(frame.layer), std::move(frame.alphaLayer), frame.exposure});
  }

  void takeNotes() {
    std::vector<std::string>& notes = capture_.notes;
    if (auto note = unknownKeys_.note()) notes.push_back(*std::move(note));
    for (std::string& note : rotations_.notes()) notes.push_back(std::move(note));
    if (notSquare_.count > 0)
      notes.push_back("pixels are not square in " + counted(notSquare_.count, "frame") +
                      ", as camera_angle_y (or y_fov) says: focal lengths are " + notSquare_.first +
                      " pixels");
    if (otherAngles_.count > 0)
      notes.push_back("angles are not those of the focal lengths, which count: " + otherAngles_.first +
                      " pixels");
    if (repeated_.count > 0)
      notes.push_back(counted(repeated_.count, "photograph") + " with view and light of another (" +
                      repeated_.first + (repeated_.count > 1 ? ", ..)" : ")") +
                      ": each is kept as a view of its own");
    if (listedTwice_ > 0)
      notes.push_back(counted(listedTwice_, "frame") + (listedTwice_ > 1 ? " are" : " is") +
                      " listed twice, and taken once");
  }

  void checkAgainstOthers(const Frame& frame) const {
    if (!capture_.frames.empty() && capture_.frames[0].light.has_value() != frame.light.has_value())
      throw Error::mismatch(frame.light ? "none, as in frames[0]" : "one, as in frames[0]",
                            frame.light ? "a light" : "no light")
          .at("light");
  }

  // Last photograph of a pose, light and split, and the view it belongs to.
  struct Shot {
    size_t copy = 0, frame = 0;
  };

  CaptureFiles files_;
  Capture capture_;
  LightList lights_;
  UnknownKeys unknownKeys_;
  RoundedRotations rotations_;
  std::map<ViewKey, std::vector<size_t>> views_;                           // of one pose, in file order
  std::map<std::tuple<size_t, std::optional<size_t>, Split>, Shot> shots_; // by the pose's first view
  Finding notSquare_, otherAngles_, repeated_;
  size_t listedTwice_ = 0;
};

Json parse(std::string_view content) {
  const std::string_view shallow = shallowPart(content, kDeepestJson);
  try {
    return Json::parse(shallow);
  } catch (const Json::parse_error& e) {
    if (shallow.size() < content.size() && e.byte > shallow.size())
      throw Error("malformed JSON: nested too deeply");
    const size_t end = std::min(e.byte, content.size());
    const auto line =
        1 + std::count(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(end), '\n');
    throw Error("malformed JSON in line " + std::to_string(line) + " (byte " + std::to_string(e.byte) + ")");
  } catch (const Json::exception&) {
    throw Error("malformed JSON: a number is too large");
  }
}

} // namespace

std::vector<Exposure> bracketOf(const Frame& frame) {
  std::vector<Exposure> bracket{{frame.picture, frame.layer, frame.alphaLayer, frame.exposure}};
  bracket.insert(bracket.end(), frame.further.begin(), frame.further.end());
  return bracket;
}

Capture parseCapture(std::string_view json, const fs::path& file, PathRule paths) {
  try {
    return CaptureReader(file, paths).read(parse(json));
  } catch (Error& e) {
    throw std::move(e).in(file);
  }
}

Capture readCapture(const fs::path& folderOrJson, PathRule paths) {
  std::error_code ignored; // reported when the file is opened
  const fs::path file =
      fs::is_directory(folderOrJson, ignored) ? folderOrJson / "transforms.json" : folderOrJson;
  return parseCapture(readFile(file, kLargestText), file, paths);
}

Capture subset(const Capture& capture, const std::function<bool(const Frame&)>& wanted) {
  Capture part = capture;
  std::erase_if(part.frames, [&](const Frame& frame) { return !wanted(frame); });

  constexpr size_t unused = std::numeric_limits<size_t>::max();
  std::vector<size_t> newView(capture.views.size(), unused), newLight(capture.lights.size(), unused);
  for (const Frame& frame : part.frames) {
    newView[frame.view] = 0;
    if (frame.light) newLight[*frame.light] = 0;
  }
  const auto keepUsed = [](auto& items, std::vector<size_t>& newIndex) {
    size_t kept = 0;
    for (size_t i = 0; i < items.size(); ++i) {
      if (newIndex[i] == unused) continue;
      if (kept != i) items[kept] = std::move(items[i]);
      newIndex[i] = kept++;
    }
    items.resize(kept);
  };
  keepUsed(part.views, newView);
  keepUsed(part.lights, newLight);
  for (Frame& frame : part.frames) {
    frame.view = newView[frame.view];
    if (frame.light) frame.light = newLight[*frame.light];
  }
  return part;
}

} // namespace surflect::capture
