// [instant-ngp] NVlabs/instant-ngp: nerf_loader.cu and nerf_dataset_tips.md
// [nerfstudio] docs.nerf.studio, "Data conventions"; nerfstudio/data/dataparsers/nerfstudio_dataparser.py
// [NeuS2] 19reborn/NeuS2, DATA_CONVENTION.md
#include "srf/capture/capture_keys.h"

#include "surfel/base/lower_case.h"
#include "surfel/base/message_text.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>

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
constexpr auto kOfLens =
    to_array<std::string_view>({"camera_angle_x", "camera_angle_y", "camera_model", "cx", "cy", "fl_x",
                                "fl_y", "h", "k1", "k2", "ortho_height", "p1", "p2", "w", "x_fov", "y_fov"});

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

constexpr Reason kLens{"none: lenses are pinholes with k1, k2, p1, p2; undistort the pictures first",
                       "pinhole simple_pinhole perspective opencv"};
constexpr Reason kFocal{"none: fl_x, fl_y, cx and cy are read instead"};
constexpr Reason kAxes{"OpenGL's axes: x right, y up, looking along -z", "opengl blender"};
constexpr Reason kStill{"none: cameras stand still while they expose", "global"};
constexpr Reason kMatte{"false: give the pictures alpha, or the frames a mask_path"};
constexpr Reason kPremultiplied{"false: colours are multiplied by alpha"};
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
    {"k3", kLens}, // lenses [instant-ngp, read_lens; nerfstudio]
    {"k4", kLens},
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

} // namespace surflect::capture
