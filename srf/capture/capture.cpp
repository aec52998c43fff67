#include "srf/capture/capture.h"

#include "srf/capture/capture_keys.h"
#include "srf/capture/file_names.h"
#include "srf/capture/json_fields.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace surflect::capture {

namespace fs = std::filesystem;

namespace {

// ---------------------------------------------------------------------------------------------------------
// Response curves.

std::array<float, image::Response::codes> readCurve(const Json& value) {
  const std::string expected = std::to_string(image::Response::codes) + " exposures";
  if (!value.is_array() || value.size() != image::Response::codes)
    throw Error::mismatch(expected, shown(value));
  std::array<float, image::Response::codes> curve;
  float last = 0;
  for (size_t z = 0; z < curve.size(); ++z)
    atField(element("", z), [&] {
      curve[z] = static_cast<float>(numberOf(value[z]));
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
// Frames.

class CaptureReader {
public:
  CaptureReader(const fs::path& file, PathRule paths) : files_(file.parent_path(), paths) {
    capture_.file = file;
  }

  Capture read(const Json& root) && {
    begin(root);
    if (required(root, "frames", listOf).empty()) throw Error("the list is empty").at("frames");
    readEach(root, "frames", [&](const Json& frame, size_t) { add(frame); });
    return std::move(*this).finish();
  }

  // In parts: all but the frames, frame by frame, the end.
  void begin(const Json& root) {
    checkKeys(objectOf(root), KeyPlace::capture, unknownKeys_);
    capture_.colorSpace = optional(root, "color_space", [](const Json& value) {
      return oneOf<ColorSpace>(value, {{"linear", ColorSpace::linear}, {"srgb", ColorSpace::srgb}});
    });
    capture_.response = optional(root, "response", readResponse);
    if (capture_.colorSpace && capture_.response)
      throw Error::mismatch("either color_space or response", "both").at("response");
    capture_.geometry = optional(root, "geometry", [this](const Json& v) { return fileAt(v); }).value_or("");
    capture_.origin = optional(root, "origin", boundedTripleOf).value_or(Vec3<double>::Zero());
    readCalibration(root);
    if (const auto lights = root.find("lights"); lights != root.end())
      atField("lights", [&] { listOf(*lights); });
    readEach(root, "lights", [this](const Json& light, size_t) {
      checkKeys(objectOf(light), KeyPlace::light, unknownKeys_);
      lights_.add(readLight(light));
    });

    shared_ = readLensFields(root);
  }
  void add(const Json& frame) { addFrame(objectOf(frame), listed_++); }
  Capture finish() && {
    capture_.lights = std::move(lights_).take();
    takeNotes();
    return std::move(capture_);
  }

private:
  template <class Read> static void readEach(const Json& root, const char* key, Read read) {
    const auto list = root.find(key);
    for (size_t i = 0; list != root.end() && i < list->size(); ++i)
      atField(element(key, i), [&] { read((*list)[i], i); });
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
    std::string written = textOf(value);
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
    if (!files_.isThere(path))
      throw Error::mismatch("a file", "none at " + path.string() + files_.similarTo(path));
    return path;
  }

  // Picture by name; Blender's exporters leave out the extension, which may be any if only one picture fits.
  fs::path pictureAt(const Json& value) {
    const fs::path path = pathOf(value);
    for (const char* extension : {"", ".png", ".jpg", ".exr"})
      if (const fs::path tried = path.string() + extension; files_.isThere(tried)) return tried;
    if (const auto called = files_.pictureCalled(path); called && files_.isThere(*called)) return *called;
    throw Error::mismatch("a picture (its extension may be left out)",
                          "none at " + path.string() + files_.similarTo(path));
  }

  void addFrame(const Json& json, size_t index) {
    checkKeys(json, KeyPlace::frame, unknownKeys_);
    checkTime(json);
    Frame frame;
    frame.picture = required(json, "file_path", [this](const Json& v) { return pictureAt(v); });
    frame.layer = optional(json, "layer", textOf).value_or("");
    frame.alphaLayer = optional(json, "alpha_layer", textOf).value_or("");
    frame.exposure = optional(json, "exposure", positiveOf).value_or(1);
    frame.mask = optional(json, "mask_path", [this](const Json& v) { return fileAt(v); }).value_or("");
    frame.split = optional(json, "split", [](const Json& v) {
                    return oneOf<Split>(v, {{"train", Split::train}, {"test", Split::test}});
                  }).value_or(Split::train);
    frame.light = optional(json, "light", [this](const Json& v) { return lights_.named(v); });
    if (!frame.light) {
      frame.light = lights_.ofFrame(json, index);
      if (frame.light) checkStrength(json);
    }

    LensFields lens = inherit(readLensFields(json), shared_);
    const bool sizeIsStated = lens.width || lens.height;
    if (!lens.width || !lens.height) lens = withSize(lens, files_.sizeOf(frame.picture));
    const Camera<AcquisitionSpace> camera{
        lensOf(lens),
        required(json, "transform_matrix", [this](const Json& v) { return readPose(v, rotations_); })};
    checkFocalLengths(lens, camera.lens, sizeIsStated);
    checkAgainstOthers(frame);
    grouping_.add(capture_, std::move(frame), optional(json, "camera", textOf), camera);
  }

  void checkTime(const Json& json) {
    const auto time = optional(json, "time", numberOf);
    if (time && capture_.time && *time != *capture_.time)
      throw Error::mismatch(
          numberText(*capture_.time) +
              ", as in the frames before: the frames are of several times, a model shows one",
          shown(json["time"]))
          .at("time");
    if (time) capture_.time = time;
  }

  // Strengths are all stated, or none, which makes them relative.
  void checkStrength(const Json& json) {
    const bool isStated = !isNull(valueAt(json, "pl_intensity"));
    if (!strengthsAreStated_) strengthsAreStated_ = isStated;
    if (isStated != *strengthsAreStated_)
      throw Error::mismatch(isStated ? "none, as in the frames before" : "one, as in the frames before",
                            shown(valueAt(json, "pl_intensity")))
          .at("pl_intensity");
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
    for (std::string& note : grouping_.notes()) notes.push_back(std::move(note));
  }

  void checkAgainstOthers(const Frame& frame) const {
    if (!capture_.frames.empty() && capture_.frames[0].light.has_value() != frame.light.has_value())
      throw Error::mismatch(frame.light ? "none, as in frames[0]" : "one, as in frames[0]",
                            frame.light ? "a light" : "no light")
          .at("light");
  }

  CaptureFiles files_;
  Capture capture_;
  LensFields shared_;
  size_t listed_ = 0; // frames so far
  LightList lights_;
  std::optional<bool> strengthsAreStated_; // by frames with a light of their own
  UnknownKeys unknownKeys_;
  RoundedRotations rotations_;
  ViewGrouping grouping_;
  Finding notSquare_, otherAngles_;
};

// Reads a capture frame by frame; empty if that fails for any reason, so that errors are those of `read`.
std::optional<Capture> readStreamed(std::string_view json, const fs::path& file, PathRule paths) {
  CaptureReader reader(file, paths);
  try {
    if (!streamFrames(
            json, [&](const Json& root) { reader.begin(root); },
            [&](const Json& frame) { reader.add(frame); }))
      return std::nullopt;
  } catch (const Error&) {
    return std::nullopt;
  }
  return std::move(reader).finish();
}

} // namespace

std::vector<Exposure> bracketOf(const Frame& frame) {
  std::vector<Exposure> bracket{{frame.picture, frame.layer, frame.alphaLayer, frame.exposure}};
  bracket.insert(bracket.end(), frame.further.begin(), frame.further.end());
  return bracket;
}

Capture parseCapture(std::string_view json, const fs::path& file, PathRule paths) {
  try {
    if (auto streamed = readStreamed(json, file, paths)) return *std::move(streamed);
    return CaptureReader(file, paths).read(parseJson(json));
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

Vec3<double> middleOfAxes(std::span<const View> views) {
  Mat3<double> sum = Mat3<double>::Identity() * 1e-9; // parallel axes have no nearest point
  Vec3<double> right = Vec3<double>::Zero();
  for (const View& view : views) {
    const Vec3<double> axis = view.camera.cameraFromWorld.rotation().row(2).transpose();
    const Mat3<double> across = Mat3<double>::Identity() - axis * axis.transpose();
    sum += across;
    right += across * view.camera.center().raw();
  }
  return sum.ldlt().solve(right);
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

namespace fs = std::filesystem;

namespace {

bool leaves(const fs::path& path) { return path.is_absolute() || *path.begin() == ".."; }

} // namespace

bool CaptureFiles::mayName(const fs::path& path) const {
  return rule_ == PathRule::anywhere || !leaves(path);
}

bool CaptureFiles::isThere(const fs::path& path) {
  if (rule_ == PathRule::unmade || found_.contains(path)) return true;
  const bool isFile = isFileInside(path);
  if (isFile) found_.insert(path);
  return isFile;
}

bool CaptureFiles::isFileInside(const fs::path& path) const {
  std::error_code failure; // an inaccessible file counts as missing
  const fs::path full = folder_ / path;
  if (!fs::is_regular_file(full, failure)) return false;
  if (rule_ == PathRule::anywhere) return true;
  const fs::path folder = folder_.empty() ? fs::path(".") : folder_;
  const fs::path place = fs::canonical(full, failure).lexically_relative(fs::canonical(folder, failure));
  if (failure || place.empty() || leaves(place))
    throw Error::mismatch(std::string("a path inside the capture's folder") + hint,
                          "a link that leads out of it: " + path.string());
  return true;
}

std::optional<fs::path> CaptureFiles::pictureCalled(const fs::path& path) const {
  return capture::pictureCalled(folder_, path);
}

std::string CaptureFiles::similarTo(const fs::path& path) const {
  const auto similar = path.is_absolute() ? std::nullopt : similarFile(folder_, path);
  return similar ? " (" + similar->string() + " is there: letter case or accents differ)" : "";
}

image::PictureSize CaptureFiles::sizeOf(const fs::path& picture) {
  const auto [known, isNew] = sizes_.try_emplace(picture);
  if (isNew) known->second = image::readPictureSize(folder_ / picture);
  return known->second;
}

namespace fs = std::filesystem;

namespace {

std::string shownPath(const fs::path& path) { return path.empty() ? "none" : path.string(); }

// Returns whether the bracket already has this picture.
bool isListed(const Frame& bracket, const Frame& frame) {
  const auto isSame = [&](const auto& e) {
    return e.exposure == frame.exposure && e.picture == frame.picture && e.layer == frame.layer &&
           e.alphaLayer == frame.alphaLayer;
  };
  return bracket.mask == frame.mask && (isSame(bracket) || std::ranges::any_of(bracket.further, isSame));
}

void addExposure(Frame& bracket, Frame frame) {
  if (bracket.mask != frame.mask)
    throw Error::mismatch("that of the other exposures, " + shownPath(bracket.mask), shownPath(frame.mask))
        .at("mask_path");
  bracket.further.push_back(
      {std::move(frame.picture), std::move(frame.layer), std::move(frame.alphaLayer), frame.exposure});
}

} // namespace

ViewGrouping::ViewKey ViewGrouping::keyOf(const std::optional<std::string>& cameraName,
                                          const Camera<AcquisitionSpace>& camera) {
  const Lens& lens = camera.lens;
  const auto& pose = camera.cameraFromWorld;
  ViewKey key{cameraName, {}};
  Eigen::Map<Eigen::Matrix<double, 24, 1>>(key.second.data()) << static_cast<double>(lens.model), lens.width,
      lens.height, lens.focalX, lens.focalY, lens.centerX, lens.centerY, lens.k1, lens.k2, lens.p1, lens.p2,
      lens.k3, pose.rotation().reshaped(), pose.translation();
  return key;
}

void ViewGrouping::add(Capture& capture, Frame frame, const std::optional<std::string>& cameraName,
                       const Camera<AcquisitionSpace>& camera) {
  std::vector<size_t>& views = views_[keyOf(cameraName, camera)];
  const auto addView = [&] {
    views.push_back(capture.views.size());
    capture.views.push_back(
        {cameraName ? *cameraName : fs::path(frame.picture).replace_extension().string(), camera});
  };
  if (views.empty()) addView();
  const std::pair place(views[0], frame.light);
  if (shown_.try_emplace({frame.picture, frame.layer}, place).first->second != place && ++shared_ == 1)
    firstShared_ = frame.picture.string() + (frame.layer.empty() ? "" : ", layer " + frame.layer);
  const size_t next = capture.frames.size();
  const auto [found, isNew] = shots_.try_emplace({views[0], frame.light, frame.split}, Shot{0, next});
  Shot& shot = found->second;
  if (!isNew) {
    Frame& last = capture.frames[shot.frame];
    const auto hasExposure = [&](const auto& e) { return e.exposure == frame.exposure; };
    if (!hasExposure(last) && std::ranges::none_of(last.further, hasExposure))
      return addExposure(last, std::move(frame));
    if (frame.split == Split::train) {
      if (isListed(last, frame)) {
        ++listedTwice_;
        return;
      }
      if (++repeated_ == 1) firstRepeated_ = frame.picture.string() + " that of " + last.picture.string();
      if (++shot.copy == views.size()) addView();
    }
    shot.frame = next;
  }
  frame.view = views[shot.copy];
  capture.frames.push_back(std::move(frame));
}

std::vector<std::string> ViewGrouping::notes() const {
  std::vector<std::string> notes;
  if (repeated_ > 0)
    notes.push_back(counted(repeated_, "photograph") + " with view and light of another (" + firstRepeated_ +
                    (repeated_ > 1 ? ", ..)" : ")") + ": each is kept as a view of its own");
  if (listedTwice_ > 0)
    notes.push_back(counted(listedTwice_, "frame") + (listedTwice_ > 1 ? " are" : " is") +
                    " listed twice, and taken once");
  if (shared_ > 0)
    notes.push_back(counted(shared_, "frame") + (shared_ > 1 ? " show" : " shows") +
                    " the picture of another camera or light (" + firstShared_ +
                    (shared_ > 1 ? ", ..)" : ")"));
  return notes;
}

} // namespace surflect::capture
