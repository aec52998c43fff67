// [instant-ngp] NVlabs/instant-ngp: nerf_loader.cu and nerf_dataset_tips.md
// [nerfstudio] docs.nerf.studio, "Data conventions"; nerfstudio/data/dataparsers/nerfstudio_dataparser.py
// [NeuS2] 19reborn/NeuS2, DATA_CONVENTION.md
#include "srf/capture/capture_keys.h"

#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/math/space.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>

namespace surflect::capture {

namespace {

using std::to_array;

// ---------------------------------------------------------------------------------------------------------
// Keys that are read.

constexpr auto kOfCapture = to_array<std::string_view>(
    {"calibration", "color_space", "frames", "geometry", "lights", "origin", "response"});

constexpr auto kOfLight = to_array<std::string_view>(
    {"cluster", "direction", "intensity", "irradiance", "irradiance_gradient", "name", "position", "type"});

constexpr auto kOfFrame =
    to_array<std::string_view>({"alpha_layer", "camera", "exposure", "file_path", "layer", "light",
                                "mask_path", "pl_intensity", "pl_pos", "split", "time", "transform_matrix"});

// Keys of a lens, allowed in the capture or in a frame.
constexpr auto kOfLens = to_array<std::string_view>({"camera_angle_x", "camera_angle_y", "camera_model", "cx",
                                                     "cy", "fl_x", "fl_y", "h", "k1", "k2", "k3",
                                                     "ortho_height", "p1", "p2", "w", "x_fov", "y_fov"});

// ---------------------------------------------------------------------------------------------------------
// Harmless keys, in the capture or in a frame.

constexpr auto kHarmless = to_array<std::string_view>(
    {// Volume of a NeRF in the poses' world; poses are unchanged [instant-ngp].
     "aabb", "aabb_scale", "offset", "render_aabb", "scale", "up",
     // Selection of training photographs, and training options of a NeRF [instant-ngp].
     "enable_depth_loading", "enable_ray_loading", "envmap", "importance_sampling", "n_extra_learnable_dims",
     "n_frames", "sharpen", "sharpness", "sharpness_discard_threshold",
     // Transforms that the poses already contain, or that a NeRF applies later [nerfstudio].
     "applied_scale", "applied_transform", "auto_scale_poses_override", "orientation_override",
     // Points and depths, which are not used [instant-ngp, nerfstudio].
     "depth_file_path", "depth_path", "depth_unit_scale_factor", "integer_depth_scale", "ply_file_path",
     // Near and far planes of a NeRF; Blender's steps between frames; numbers and notes of exporters.
     "colmap_im_id", "comment", "far", "near", "rotation", "timestamp", "version"});

// ---------------------------------------------------------------------------------------------------------
// Unsupported keys, in any place.

enum class KeyUse {
  read,
  harmless,    // does not affect the photographs, or is already in the poses
  unsupported, // changes the meaning of photographs, unless its value is neutral: false, 0, "none"
  unknown
};

struct KeyRule {
  KeyUse use = KeyUse::unknown;
  std::string_view expected = {}; // for the Error about an unsupported key
  std::string_view neutral = {};  // lower-case words that are neutral under an unsupported key
};

struct Reason {
  std::string_view expected, neutral = {};
};

constexpr Reason kLens{"none: lenses are pinholes with k1, k2, k3, p1, p2; undistort the pictures first",
                       "pinhole simple_pinhole perspective opencv"};
constexpr Reason kFocal{"none: fl_x, fl_y, cx and cy are read instead"};
constexpr Reason kAxes{"OpenGL's axes: x right, y up, looking along -z", "opengl blender"};
constexpr Reason kStill{"none: cameras stand still while they expose", "global"};
constexpr Reason kMatte{"false: give the pictures alpha, or the frames a mask_path"};
constexpr Reason kPremultiplied{
    "false: colours of EXR are taken as multiplied by alpha, those of PNG as not; "
    "surflect import --fix-premult divides those of PNG"};
constexpr Reason kMask{"none: a frame's mask_path is read instead"};
constexpr Reason kAlpha{"none: alpha is read from the pictures, of an EXR as alpha_layer says"};
constexpr Reason kColors{"none: color_space is read instead, \"linear\" or \"srgb\""};
constexpr Reason kLight{"none: light, or pl_pos and pl_intensity, are read instead"};
constexpr Reason kForImport{"none here: surflect import reads it"};
constexpr Reason kOfWhole{"none here: it is a key of the whole capture"};
constexpr Reason kOfOne{"none here: it is a key of a frame"};

struct Unsupported {
  std::string_view key;
  Reason reason;
};

constexpr auto kUnsupported = to_array<Unsupported>({
    {"k4", kLens}, // lenses [instant-ngp, read_lens; nerfstudio]
    {"k5", kLens},
    {"k6", kLens},
    {"p3", kLens},
    {"camera_type", kLens},
    {"latlong", kLens},
    {"projection", kLens},
    {"skew", kFocal},
    {"K", kFocal},
    {"transform_matrix_start", kStill}, // poses at the shutter's opening and closing [instant-ngp]
    {"transform_matrix_end", kStill},
    {"from_na", kAxes},            // looking along +z, y down [NeuS2]
    {"normal_mts_args", kAxes},    // Mitsuba's: x left, looking along +z [instant-ngp]
    {"black_transparent", kMatte}, // background colour used as matte [instant-ngp]
    {"white_transparent", kMatte},
    {"fix_premult", kPremultiplied},   // [instant-ngp]
    {"driver_parameters", kLight},     // LightX, LightY, LightZ of a frame [instant-ngp]
    {"camera_intrinsics", kForImport}, // [cx, cy, fl_x, fl_y] of NRHints and GS3
    {"file_ext", kForImport},          // of NRHints
    {"img_path", kForImport},          // of GS3
    {"train_filenames", kForImport},   // [nerfstudio]
    {"test_filenames", kForImport},
    {"val_filenames", kForImport},
});

// Parts of unsupported names, in lower case: "ftheta_p1", "isFisheye", "lens_mode", "distortion_params",
// "mask_file".
constexpr auto kUnsupportedParts = to_array<Unsupported>({
    {"distort", kLens},
    {"equirect", kLens},
    {"fisheye", kLens},
    {"ftheta", kLens},
    {"lens", kLens},
    {"panorama", kLens},
    {"intrinsic", kFocal},
    {"convention", kAxes},
    {"coordinate", kAxes},
    {"rolling_shutter", kStill},
    {"mask", kMask},
    {"alpha", kAlpha},
    {"gamma", kColors},
    {"colorspace", kColors},
    {"color_space", kColors},
    {"colour", kColors},
});

// Beginning of a UTF-8 text, cut between two characters.
std::string shortened(const std::string& text) {
  size_t end = 60;
  if (text.size() <= end) return text;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

KeyRule unsupported(const Reason& reason) { return {KeyUse::unsupported, reason.expected, reason.neutral}; }

bool isOneOf(const auto& list, std::string_view key) {
  return std::find(list.begin(), list.end(), key) != list.end();
}

// Known key that differs in letter case alone; empty if there is none.
std::string_view rightSpelling(std::string_view key, const auto&... lists) {
  const std::string lower = lowerCase(key);
  std::string_view right;
  const auto look = [&](const auto& list) {
    if (const auto known = std::ranges::find(list, lower); known != list.end()) right = *known;
  };
  (look(lists), ...);
  return right;
}

KeyRule keyRule(std::string_view key, KeyPlace place) {
  if (place == KeyPlace::light) {
    if (isOneOf(kOfLight, key)) return {KeyUse::read};
    const std::string_view spelling = rightSpelling(key, kOfLight);
    return spelling.empty() ? KeyRule{} : unsupported({spelling});
  }
  const bool ofCapture = isOneOf(kOfCapture, key), ofFrame = isOneOf(kOfFrame, key);
  if (isOneOf(kOfLens, key) || (place == KeyPlace::frame ? ofFrame : ofCapture)) return {KeyUse::read};
  if (ofCapture || ofFrame) return unsupported(ofCapture ? kOfWhole : kOfOne);
  if (isOneOf(kHarmless, key)) return {KeyUse::harmless};
  for (const auto& [name, reason] : kUnsupported)
    if (key == name) return unsupported(reason);
  if (const auto spelling = rightSpelling(key, kOfCapture, kOfFrame, kOfLens); !spelling.empty())
    return unsupported({spelling});
  const std::string lower = lowerCase(key);
  for (const auto& [part, reason] : kUnsupportedParts)
    if (lower.find(part) != std::string_view::npos) return unsupported(reason);
  return {};
}

std::vector<std::string_view> keysReadAt(KeyPlace place) {
  std::vector<std::string_view> keys(kOfLight.begin(), kOfLight.end());
  if (place == KeyPlace::light) return keys;
  keys.assign(kOfLens.begin(), kOfLens.end());
  if (place == KeyPlace::frame)
    keys.insert(keys.end(), kOfFrame.begin(), kOfFrame.end());
  else
    keys.insert(keys.end(), kOfCapture.begin(), kOfCapture.end());
  return keys;
}

// Returns whether a value means that its key does not apply: null, false, 0, "none", one of the words, or a
// list of such values.
bool saysNothing(const Json& value, std::string_view words) {
  if (value.is_boolean()) return !value.get<bool>();
  if (value.is_number()) return value.get<double>() == 0;
  if (value.is_array())
    return std::all_of(value.begin(), value.end(), [&](const Json& v) { return saysNothing(v, words); });
  if (!value.is_string()) return value.empty();
  const std::string word = lowerCase(value.get<std::string>());
  const auto between = [](std::string_view text) { return std::string(" ").append(text).append(" "); };
  return word.empty() || word == "none" || between(words).find(between(word)) != std::string::npos;
}

// Returns whether the start or end of a camera's motion equals its pose.
bool standsStill(const Json& object, std::string_view key, const Json& value) {
  const auto pose = object.find("transform_matrix");
  return key.starts_with("transform_matrix_") && pose != object.end() && *pose == value;
}

} // namespace

std::optional<std::string> UnknownKeys::note() const {
  if (counts_.empty()) return std::nullopt;
  constexpr size_t mostNamed = 10;
  const size_t all = counts_.size();
  std::string list;
  for (size_t i = 0; const auto& [where, count] : counts_) {
    const auto& [key, place] = where;
    if (i++ == mostNamed) break;
    list += (i > 1 ? ", \"" : "\"") + shortened(key) + "\"";
    for (char& c : list) // names come from outside; a note is one line
      if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
    if (place != KeyPlace::capture)
      list += " (in " + counted(count, place == KeyPlace::frame ? "frame" : "light") + ")";
    list += didYouMean(key, keysReadAt(place));
  }
  return counted(all, "key") + (all > 1 ? " are" : " is") + " not known and passed over: " + list +
         (all > mostNamed ? " and " + std::to_string(all - mostNamed) + " more" : "");
}

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

namespace {

double fieldOfView(const Json& value) {
  const double angle = positiveOf(value);
  if (!(angle < std::numbers::pi)) throw Error::mismatch("radians below pi", shown(value));
  return angle;
}

double fieldOfViewDegrees(const Json& value) {
  const double angle = positiveOf(value);
  if (!(angle < 180)) throw Error::mismatch("degrees below 180", shown(value));
  return Angle::fromDegrees(angle).radians();
}

// Returns whether two angles in radians are equal up to rounding to two decimals or to whole degrees.
bool sameAngle(double a, double b) { return std::abs(a - b) <= 0.01; }

// Angle in NeRF's radians or, under another key, instant-ngp's degrees.
std::optional<double> angleOf(const Json& object, const char* inRadians, const char* inDegrees) {
  const auto radians = optional(object, inRadians, fieldOfView),
             degrees = optional(object, inDegrees, fieldOfViewDegrees);
  if (radians && degrees && !sameAngle(*radians, *degrees))
    throw Error::mismatch("about " + numberText(Angle::fromRadians(*radians).degrees()) + ", as " +
                              inRadians + " says",
                          shown(valueAt(object, inDegrees)))
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

// f = size / 2 / tan(angle / 2) for the angle between opposite edges of the picture.
double focalLengthOf(double angle, int size) { return size / 2. / std::tan(angle / 2); }

std::optional<double> focalLength(std::optional<double> stated, std::optional<double> angle, int size) {
  return stated || !angle ? stated : focalLengthOf(*angle, size);
}

} // namespace

LensFields readLensFields(const Json& object) {
  return {.model = optional(object, "camera_model", lensModel),
          .width = optional(object, "w", pixelCountOf),
          .height = optional(object, "h", pixelCountOf),
          .focalX = optional(object, "fl_x", positiveOf),
          .focalY = optional(object, "fl_y", positiveOf),
          .angleX = angleOf(object, "camera_angle_x", "x_fov"),
          .angleY = angleOf(object, "camera_angle_y", "y_fov"),
          .orthoHeight = optional(object, "ortho_height", positiveOf),
          .centerX = optional(object, "cx", coordinateOf),
          .centerY = optional(object, "cy", coordinateOf),
          .k1 = optional(object, "k1", numberOf),
          .k2 = optional(object, "k2", numberOf),
          .k3 = optional(object, "k3", numberOf),
          .p1 = optional(object, "p1", numberOf),
          .p2 = optional(object, "p2", numberOf)};
}

LensFields inherit(LensFields frame, const LensFields& capture) {
  const bool ownX = frame.focalX || frame.angleX, ownY = frame.focalY || frame.angleY;
  if (!ownX) {
    frame.focalX = capture.focalX;
    frame.angleX = capture.angleX;
  }
  if (!ownX && !ownY) {
    frame.focalY = capture.focalY;
    frame.angleY = capture.angleY;
  }
  const auto take = [](auto& own, const auto& outer) {
    if (!own) own = outer;
  };
  take(frame.model, capture.model);
  take(frame.width, capture.width);
  take(frame.height, capture.height);
  take(frame.orthoHeight, capture.orthoHeight);
  take(frame.centerX, capture.centerX);
  take(frame.centerY, capture.centerY);
  take(frame.k1, capture.k1);
  take(frame.k2, capture.k2);
  take(frame.k3, capture.k3);
  take(frame.p1, capture.p1);
  take(frame.p2, capture.p2);
  return frame;
}

LensFields withSize(LensFields lens, image::PictureSize picture) {
  const double shape = static_cast<double>(picture.width) / picture.height;
  const auto pixels = [](double x) {
    return static_cast<int>(std::clamp<double>(std::round(x), 1, image::kMostSide));
  };
  if (!lens.width) lens.width = lens.height ? pixels(*lens.height * shape) : picture.width;
  if (!lens.height) lens.height = pixels(*lens.width / shape);
  return lens;
}

std::optional<double> otherFocalLength(std::optional<double> focal, std::optional<double> angle, int size) {
  if (!focal || !angle || sameAngle(*angle, 2 * std::atan(size / 2. / *focal))) return std::nullopt;
  return focalLengthOf(*angle, size);
}

Lens lensOf(const LensFields& fields) {
  assert(fields.width && fields.height);
  Lens lens{
      .model = fields.model.value_or(Lens::Model::pinhole), .width = *fields.width, .height = *fields.height};
  if (lens.model == Lens::Model::orthographic) {
    if (!fields.orthoHeight) throw Error::mismatch("a number above 0", "nothing").at("ortho_height");
    lens.focalX = lens.focalY = lens.height / *fields.orthoHeight;
  } else {
    const auto x = focalLength(fields.focalX, fields.angleX, lens.width),
               y = focalLength(fields.focalY, fields.angleY, lens.height);
    if (!x)
      throw Error::mismatch(
          y ? "a number above 0, or camera_angle_x, as the vertical one does not say whether "
              "pixels are square"
            : "a number above 0, or camera_angle_x",
          "nothing")
          .at("fl_x");
    lens.focalX = *x;
    lens.focalY = y.value_or(*x);
  }
  lens.centerX = fields.centerX.value_or(lens.width / 2.);
  lens.centerY = fields.centerY.value_or(lens.height / 2.);
  lens.k1 = fields.k1.value_or(0);
  lens.k2 = fields.k2.value_or(0);
  lens.k3 = fields.k3.value_or(0);
  lens.p1 = fields.p1.value_or(0);
  lens.p2 = fields.p2.value_or(0);
  return lens;
}

namespace {

DirectionalLight readDirectional(const Json& light) {
  const Vec3<double> towards = required(light, "direction", [](const Json& value) {
    const Vec3<double> direction = tripleOf(value);
    const double found = direction.norm();
    if (!(std::abs(found - 1) <= 1e-3)) throw Error::mismatch("a unit vector", "length " + numberText(found));
    return Vec3<double>(std::abs(found - 1) > 1e-14 ? direction / found : direction);
  });
  return {assume<Direction3<AcquisitionSpace, double>>(towards), required(light, "irradiance", strengthsOf),
          optional(light, "irradiance_gradient", boundedTripleOf).value_or(Vec3<double>::Zero())};
}

PointLight readPoint(const Json& light) {
  return {required(light, "position", pointOf), required(light, "intensity", strengthsOf)};
}

} // namespace

Light readLight(const Json& value) {
  const Json& object = objectOf(value);
  Light light;
  light.name = required(object, "name", textOf);
  light.identity = optional(object, "cluster", textOf).value_or(light.name);
  const bool directional = required(object, "type", [](const Json& type) {
    return oneOf<bool>(type, {{"directional", true}, {"point", false}});
  });
  if (directional)
    light.kind = readDirectional(object);
  else
    light.kind = readPoint(object);
  return light;
}

size_t LightList::add(Light light) {
  const size_t index = lights_.size();
  if (!byName_.try_emplace(light.name, index).second)
    throw Error("a second light is called " + light.name).at("name");
  if (const auto* point = std::get_if<PointLight>(&light.kind)) byPoint_.try_emplace(keyOf(*point), index);
  lights_.push_back(std::move(light));
  return index;
}

size_t LightList::named(const Json& value) const {
  const std::string name = textOf(value);
  if (const auto known = byName_.find(name); known != byName_.end()) return known->second;
  if (lights_.empty()) throw Error::mismatch("no light, as the capture lists none", shown(value));
  std::vector<std::string_view> known;
  for (const Light& light : lights_) known.push_back(light.name);
  const std::vector<std::string> names(known.begin(), known.end());
  throw Error::mismatch("a light of the list: " + firstNames(names) + didYouMean(name, known), shown(value));
}

std::optional<size_t> LightList::ofFrame(const Json& frame, size_t frameIndex) {
  const auto position = optional(frame, "pl_pos", pointOf);
  if (!position) return std::nullopt;
  const PointLight point{*position,
                         optional(frame, "pl_intensity", strengthsOrGrayOf).value_or(Rgb{1, 1, 1})};
  if (const auto known = byPoint_.find(keyOf(point)); known != byPoint_.end()) return known->second;
  const std::string name = element("pl_pos", frameIndex);
  return add({name, name, point});
}

LightList::PointKey LightList::keyOf(const PointLight& light) {
  const auto& [r, g, b] = light.intensity;
  return {light.position.x(), light.position.y(), light.position.z(), r, g, b};
}

namespace {

// Tolerance. Errors of half a unit in the third decimal change |a|^2 of a column, and a . b of two, by up to
// sqrt(3) 1e-3. With two decimals a camera would be off by half a degree, many pixels, so that is refused.
constexpr double kLimit = 2e-3;
constexpr double kSaid = 1e-4; // reported above; single precision and six decimals are well below

// Largest entry of |R^T R - 1|.
double deviationOf(const Mat3<double>& matrix) {
  return (matrix.transpose() * matrix - Mat3<double>::Identity()).cwiseAbs().maxCoeff();
}

std::string twoDigits(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", number);
  return text;
}

std::string rotationsAre(size_t count) { return counted(count, "rotation") + (count == 1 ? " is" : " are"); }

} // namespace

void RoundedRotations::count(double deviation) {
  if (deviation > kSaid) ++rounded_;
  largestDeviation_ = std::max(largestDeviation_, deviation);
}

Mat3<double> RoundedRotations::nearest(const Mat3<double>& matrix) {
  const double deviation = deviationOf(matrix);
  if (!(deviation <= kLimit))
    throw Error::mismatch("a rotation, with 3 decimals or more",
                          "a matrix that is not orthonormal by " + numberText(deviation));
  if (matrix.determinant() < 0) throw Error::mismatch("a rotation", "a reflection");
  count(deviation);
  // Keep an exact rotation bit by bit.
  return deviation > 1e-14 ? nearestRotation(matrix) : matrix;
}

Mat3<double> RoundedRotations::nearestUnscaled(const Mat3<double>& worldFromCamera) {
  const double scale = std::cbrt(std::abs(worldFromCamera.determinant()));
  const bool scaled =
      scale > 0 && deviationOf(worldFromCamera) > kLimit && deviationOf(worldFromCamera / scale) <= kLimit;
  const Mat3<double> rotation = nearest(scaled ? Mat3<double>(worldFromCamera / scale) : worldFromCamera);
  if (scaled) {
    ++scaled_;
    leastScale_ = std::min(leastScale_, scale);
    mostScale_ = std::max(mostScale_, scale);
  }
  return rotation;
}

std::vector<std::string> RoundedRotations::notes() const {
  std::vector<std::string> notes;
  if (rounded_ > 0)
    notes.push_back(rotationsAre(rounded_) + " rounded, off by up to " + twoDigits(largestDeviation_) +
                    "; the nearest rotation is taken");
  if (scaled_ > 0) {
    const std::string least = numberText(std::round(leastScale_ * 1e4) / 1e4),
                      most = numberText(std::round(mostScale_ * 1e4) / 1e4);
    notes.push_back(rotationsAre(scaled_) + " scaled, by " + least + (least != most ? " to " + most : "") +
                    "; the scale is left out");
  }
  return notes;
}

Rigid<CameraSpace, AcquisitionSpace> readPose(const Json& value, RoundedRotations& rotations) {
  Eigen::Matrix4d m;
  const auto fourOf = [](const Json& list, const char* expected) -> const Json& {
    if (!list.is_array() || list.size() != 4) throw Error::mismatch(expected, shown(list));
    return list;
  };
  for (size_t row = 0; row < 4; ++row) {
    const Json& rows = fourOf(value, "four rows of four numbers");
    atField(element("", row), [&] {
      const Json& columns = fourOf(rows[row], "four numbers");
      for (size_t c = 0; c < 4; ++c)
        m(static_cast<int>(row), static_cast<int>(c)) =
            atField(element("", c), [&] { return coordinateOf(columns[c]); });
    });
  }
  if (!(m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).isZero(1e-6))
    throw Error::mismatch("last row 0 0 0 1", shown(value[3])).at("[3]");
  const Mat3<double> rotation = rotations.nearestUnscaled(m.topLeftCorner<3, 3>());
  return Rigid<AcquisitionSpace, CameraSpace>(rotation, m.topRightCorner<3, 1>()).inverse();
}

} // namespace surflect::capture
