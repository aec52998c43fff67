#include "srf/import/lamps.h"

#include "srf/capture/rig.h"
#include "srf/image/image_file.h"
#include "srf/import/lit_view.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace surflect::importers {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCamera = "{camera}", kLight = "{light}";

// A light of irradiance or intensity 1 in all channels.
capture::Light lamp(const std::string& name, const Vec3<double>& vector, bool isPosition, float strength) {
  const Rgb white{strength, strength, strength};
  if (isPosition)
    return {name, name, capture::PointLight{assume<Point3<AcquisitionSpace, double>>(vector), white}};
  return {
      name, name,
      capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(vector.normalized()), white}};
}

// Intensity of equal lamps at these places whose mean irradiance at the object is 1.
float alikeIntensity(const std::vector<Vec3<double>>& places, const std::vector<capture::View>& views) {
  const Vec3<double> middle = capture::middleOfAxes(views);
  double sum = 0;
  for (const Vec3<double>& place : places) sum += 1 / std::max((place - middle).squaredNorm(), 1e-12);
  return static_cast<float>(static_cast<double>(places.size()) / sum);
}

// Poses of one camera's registered pictures.
class Poses {
public:
  void add(const capture::Camera<AcquisitionSpace>& camera) {
    if (count_ == 0) first_ = camera;
    Eigen::Quaterniond turn(camera.cameraFromWorld.rotation());
    if (turn.coeffs().dot(turns_) < 0) turn.coeffs() = -turn.coeffs();
    turns_ += turn.coeffs();
    centers_ += camera.center().raw();
    ++count_;
    farthest_ = std::max(farthest_, (camera.center().raw() - first_.center().raw()).norm());
  }
  // Lens of the first; means of places and of rotations, by the sum of their quaternions.
  capture::Camera<AcquisitionSpace> mean() const {
    if (count_ == 1) return first_;
    const Mat3<double> rotation = Eigen::Quaterniond(Vec4(turns_.normalized())).toRotationMatrix();
    const Vec3<double> center = centers_ / static_cast<double>(count_);
    return {first_.lens, {rotation, -(rotation * center)}};
  }
  size_t count() const { return count_; }
  double farthest() const { return farthest_; } // of a picture from the first one

private:
  using Vec4 = Eigen::Vector4d;
  capture::Camera<AcquisitionSpace> first_;
  Vec4 turns_ = Vec4::Zero();
  Vec3<double> centers_ = Vec3<double>::Zero();
  size_t count_ = 0;
  double farthest_ = 0;
};

// Pictures below a folder by their names from there, in natural order.
std::vector<std::string> namesBelow(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code problem;
  for (fs::recursive_directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem))
    if (entry->is_regular_file() && !isHidden(entry->path()))
      names.push_back(entry->path().lexically_relative(folder).generic_string());
  if (problem) throw Error("cannot be listed (" + problem.message() + ")").in(folder);
  std::ranges::sort(names, naturallyBefore);
  return names;
}

std::map<std::string, size_t> addLamps(ForeignCapture& source, const LampOptions& options) {
  if (options.lights.empty()) throw Error("a table of lights is needed beside --pattern").at("--lights");
  try {
    const std::vector<LightEntry> entries = parseLights(withDecimalPoints(readFile(options.lights)));
    std::vector<Vec3<double>> places;
    for (const LightEntry& entry : entries) places.push_back(entry.vector);
    const float strength = options.positions ? alikeIntensity(places, source.capture.views) : 1;
    std::map<std::string, size_t> numbers;
    for (const LightEntry& entry : entries) {
      const auto complain = [&](Error problem) {
        return std::move(problem).at("line " + std::to_string(entry.line));
      };
      if (entry.name.empty()) throw complain(Error::mismatch("a name before x y z", "none"));
      if (!options.positions && !(entry.vector.norm() > 0))
        throw complain(Error::mismatch("a direction", "0 0 0"));
      // The table may name pictures: their extension is none of a light's name.
      const std::string name =
          image::isPictureName(entry.name) ? fs::path(entry.name).stem().string() : entry.name;
      if (!numbers.emplace(name, source.capture.lights.size()).second)
        throw complain(Error("light " + shownText(name) + " is listed twice"));
      source.capture.lights.push_back(lamp(name, entry.vector, options.positions, strength));
    }
    return numbers;
  } catch (Error& error) {
    throw std::move(error).in(options.lights);
  }
}

// Photographs of all pictures that fit the pattern.
void lightByNames(ForeignCapture& source, const LampOptions& options) {
  std::map<std::string, Poses> cameras;
  size_t unfit = 0;
  for (const capture::Frame& frame : source.capture.frames) {
    const std::string name = frame.picture.lexically_relative(source.files.root).generic_string();
    if (const auto named = matched(options.pattern, name))
      cameras[named->camera].add(source.capture.views[frame.view].camera);
    else
      ++unfit;
  }
  if (cameras.empty())
    throw Error::mismatch(
        "names of pictures such as " +
            shownText(
                source.capture.frames.front().picture.lexically_relative(source.files.root).generic_string()),
        shownText(options.pattern))
        .at("--pattern");
  const std::map<std::string, size_t> lights = addLamps(source, options);

  capture::Capture& capture = source.capture;
  capture.views.clear();
  capture.frames.clear();
  std::map<std::string, size_t> views;
  size_t several = 0;
  double farthest = 0;
  for (const auto& [name, poses] : cameras) {
    views[name] = capture.views.size();
    capture.views.push_back({name, poses.mean()});
    if (poses.count() > 1) ++several, farthest = std::max(farthest, poses.farthest());
  }
  size_t withoutPose = 0;
  std::string unknown;
  for (const std::string& name : namesBelow(source.files.root)) {
    const auto named = matched(options.pattern, name);
    if (!named) continue;
    const auto view = views.find(named->camera);
    const auto light = lights.find(named->light);
    if (view == views.end()) {
      ++withoutPose;
    } else if (light == lights.end()) {
      throw Error::mismatch("a light of " + options.lights.string(), shownText(named->light))
          .at("picture " + shownText(name));
    } else {
      capture.frames.push_back(
          {.view = view->second, .light = light->second, .picture = source.files.at(name)});
    }
  }
  source.notes.push_back(counted(capture.frames.size(), "picture") + " of " +
                         counted(views.size(), "camera") + " by their names, " + shownText(options.pattern) +
                         "; strengths of lights are taken as equal");
  if (several > 0)
    source.notes.push_back(counted(several, "camera") + " with several registered pictures, up to " +
                           numberText(farthest) + " scene units apart: the mean of their poses is taken");
  if (withoutPose > 0)
    source.notes.push_back("warning: " + counted(withoutPose, "picture") +
                           " left out, of cameras without a registered picture");
  if (unfit > 0)
    source.notes.push_back("warning: " + counted(unfit, "registered picture") +
                           " left out, as the name does not fit");
}

// A lamp a photograph, at the camera.
void lightByFlash(ForeignCapture& source, const Vec3<double>& offset) {
  capture::Capture& capture = source.capture;
  std::vector<Vec3<double>> places;
  for (const capture::View& view : capture.views)
    places.push_back(
        view.camera.cameraFromWorld.inverse()(assume<Point3<CameraSpace, double>>(offset)).raw());
  const float strength = alikeIntensity(places, capture.views);
  for (size_t v = 0; v < places.size(); ++v)
    capture.lights.push_back(lamp("flash " + capture.views[v].identity, places[v], true, strength));
  for (capture::Frame& frame : capture.frames) frame.light = frame.view;
  source.notes.push_back("each photograph is lit by a flash at (" + numberText(offset.x()) + ", " +
                         numberText(offset.y()) + ", " + numberText(offset.z()) +
                         ") from its camera, always of one intensity");
}

} // namespace

std::optional<LitName> matched(std::string_view pattern, std::string_view name) {
  const size_t camera = pattern.find(kCamera), light = pattern.find(kLight);
  const bool isTwice = camera != pattern.rfind(kCamera) || light != pattern.rfind(kLight);
  if (camera == pattern.npos || light == pattern.npos || isTwice)
    throw Error::mismatch("{camera} and {light}, once each", shownText(pattern)).at("--pattern");
  const bool isCameraFirst = camera < light;
  const std::string_view first = isCameraFirst ? kCamera : kLight, second = isCameraFirst ? kLight : kCamera;
  const size_t begin = std::min(camera, light), next = std::max(camera, light);
  const std::string_view before = pattern.substr(0, begin),
                         between = pattern.substr(begin + first.size(), next - begin - first.size()),
                         after = pattern.substr(next + second.size());
  if (between.empty())
    throw Error::mismatch("something between {camera} and {light}", shownText(pattern)).at("--pattern");
  if (!name.starts_with(before) || !name.ends_with(after) || name.size() < before.size() + after.size())
    return std::nullopt;
  const std::string_view middle = name.substr(before.size(), name.size() - before.size() - after.size());
  const size_t at = middle.find(between);
  if (at == middle.npos) return std::nullopt;
  const std::string_view one = middle.substr(0, at), other = middle.substr(at + between.size());
  const auto isPlain = [](std::string_view word) { return !word.empty() && word.find('/') == word.npos; };
  if (!isPlain(one) || !isPlain(other)) return std::nullopt;
  return isCameraFirst ? LitName{std::string(one), std::string(other)}
                       : LitName{std::string(other), std::string(one)};
}

void giveLights(ForeignCapture& source, const LampOptions& options) {
  if (std::ranges::any_of(source.capture.frames,
                          [](const capture::Frame& frame) { return frame.light.has_value(); }))
    throw Error("the source states lights of its own").at(options.flash ? "--flash" : "--pattern");
  options.flash ? lightByFlash(source, *options.flash) : lightByNames(source, options);
}

} // namespace surflect::importers
