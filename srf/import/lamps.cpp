#include "srf/import/lamps.h"

#include "srf/calibration/lamp_places.h"
#include "srf/capture/photograph.h"
#include "srf/capture/rig.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/import/ball_lamps.h"
#include "srf/import/lit_view.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/bounds.h"
#include "surfel/math/median.h"

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
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

// Name that stands for {light} in a picture's name; empty if the name does not fit.
std::optional<std::string> lampNamed(std::string_view pattern, std::string_view name) {
  const size_t at = pattern.find(kLight);
  if (at == pattern.npos || at != pattern.rfind(kLight) || pattern.find(kCamera) != pattern.npos)
    throw Error::mismatch("{light}, once, and no {camera}", shownText(pattern)).at("--lamp-images");
  const std::string_view before = pattern.substr(0, at), after = pattern.substr(at + kLight.size());
  if (!name.starts_with(before) || !name.ends_with(after) || name.size() <= before.size() + after.size())
    return std::nullopt;
  const std::string_view light = name.substr(before.size(), name.size() - before.size() - after.size());
  return light.find('/') == light.npos ? std::optional<std::string>(light) : std::nullopt;
}

std::string nameBelowRoot(const ForeignCapture& source, const capture::Frame& frame) {
  return frame.picture.lexically_relative(source.files.root).generic_string();
}

// Lamps where registered pictures were taken; the pictures are no photographs of the capture.
std::map<std::string, size_t> takeLampImages(ForeignCapture& source, const std::string& pattern) {
  std::map<std::string, size_t> numbers;
  std::vector<std::string> names;
  std::vector<Vec3<double>> places;
  std::erase_if(source.capture.frames, [&](const capture::Frame& frame) {
    const auto name = lampNamed(pattern, nameBelowRoot(source, frame));
    if (!name) return false;
    numbers[*name] = names.size();
    names.push_back(*name);
    places.push_back(source.capture.views[frame.view].camera.center().raw());
    return true;
  });
  if (names.empty() || source.capture.frames.empty())
    throw Error::mismatch("the names of some registered pictures", shownText(pattern)).at("--lamp-images");
  std::vector<capture::View> cameras;
  for (const capture::Frame& frame : source.capture.frames)
    cameras.push_back(source.capture.views[frame.view]);
  const float strength = alikeIntensity(places, cameras);
  for (size_t l = 0; l < names.size(); ++l)
    source.capture.lights.push_back(lamp(names[l], places[l], true, strength));
  source.notes.push_back(counted(names.size(), "lamp") + " where registered pictures were taken, " +
                         shownText(pattern));
  return numbers;
}

// Lamps of the photographs of these cameras whose names fit the pattern, without places so far.
std::map<std::string, size_t> addUnplacedLamps(ForeignCapture& source, const std::string& pattern,
                                               const std::map<std::string, Poses>& cameras) {
  std::map<std::string, size_t> numbers;
  std::set<std::string> ofOthers;
  for (const std::string& name : namesBelow(source.files.root)) {
    const auto named = matched(pattern, name);
    if (!named) continue;
    if (!cameras.contains(named->camera)) {
      ofOthers.insert(named->light);
    } else if (numbers.emplace(named->light, source.capture.lights.size()).second) {
      source.capture.lights.push_back(lamp(named->light, {0, 0, 1}, false, 1));
    }
  }
  std::vector<std::string> leftOut;
  for (const std::string& light : ofOthers)
    if (!numbers.contains(light)) leftOut.push_back(light);
  if (!leftOut.empty())
    source.notes.push_back(
        "warning: " + counted(leftOut.size(), "lamp") +
        " left out, of cameras without a registered picture alone: " + firstNames(leftOut));
  return numbers;
}

// Lamps by a mirror ball, of equal strengths: each has irradiance 1 on average.
std::map<std::string, size_t> addBallLamps(ForeignCapture& source, const LampOptions& options,
                                           const std::map<std::string, Poses>& cameras,
                                           const Progress& progress) {
  std::map<std::string, capture::Camera<AcquisitionSpace>> poses;
  for (const auto& [name, ofName] : cameras) poses[name] = ofName.mean();
  const BallLamps ball = lampsOfBall(options.chromeBall, options.pattern, poses, progress);
  source.notes.insert(source.notes.end(), ball.notes.begin(), ball.notes.end());
  std::vector<Vec3<double>> places;
  for (const auto& [name, one] : ball.lamps)
    if (one.isNear) places.push_back(one.place);
  const float strength = places.empty() ? 1 : alikeIntensity(places, source.capture.views);
  std::map<std::string, size_t> numbers;
  for (const auto& [name, one] : ball.lamps) {
    numbers[name] = source.capture.lights.size();
    source.capture.lights.push_back(
        lamp(name, one.isNear ? one.place : one.towards, one.isNear, one.isNear ? strength : 1));
  }
  return numbers;
}

// "4.9 to 5.1", with two digits.
std::string rangeText(const std::vector<double>& values) {
  const auto [least, most] = std::ranges::minmax(values);
  const auto text = [](double value) { return fmt::format("{:.2g}", value); };
  return text(least) == text(most) ? text(least) : text(least) + " to " + text(most);
}

// Note on how a table of lamps was read, in which a wrong unit or a forgotten --positions shows; empty for
// unit directions.
std::string noteOnTable(const std::vector<Vec3<double>>& vectors, bool positions,
                        const std::vector<capture::View>& views) {
  std::vector<double> lengths, cameras;
  const Vec3<double> middle = positions ? capture::middleOfAxes(views) : Vec3<double>(0, 0, 0);
  for (const Vec3<double>& vector : vectors) lengths.push_back((vector - middle).norm());
  const auto isUnit = [](double length) { return std::abs(length - 1) < 0.1; };
  if (!positions && std::ranges::all_of(lengths, isUnit)) return "";
  if (!positions)
    return "lamps are directions of lengths " + rangeText(lengths) + "; if they are places: --positions";
  for (const capture::View& view : views) cameras.push_back((view.camera.center().raw() - middle).norm());
  return "lamps stand " + rangeText(lengths) + " from the point that the cameras look at, and cameras " +
         rangeText(cameras) + ", in scene units";
}

std::map<std::string, size_t> addLamps(ForeignCapture& source, const LampOptions& options,
                                       const std::map<std::string, Poses>& cameras,
                                       const Progress& progress) {
  if (!options.chromeBall.empty()) return addBallLamps(source, options, cameras, progress);
  if (options.findLamps) return addUnplacedLamps(source, options.pattern, cameras);
  if (options.lights.empty())
    throw Error("a table of lights is needed beside --pattern, or \"auto\", --chrome-ball or --lamp-images")
        .at("--lights");
  try {
    const std::vector<LightEntry> entries = parseLights(withDecimalPoints(readFile(options.lights)));
    std::vector<Vec3<double>> places;
    for (const LightEntry& entry : entries) places.push_back(entry.vector);
    if (!entries.empty())
      if (const std::string note = noteOnTable(places, options.positions, source.capture.views);
          !note.empty())
        source.notes.push_back(note);
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
void lightByNames(ForeignCapture& source, const LampOptions& options, const Progress& progress) {
  std::map<std::string, size_t> lights;
  if (!options.lampImages.empty()) lights = takeLampImages(source, options.lampImages);
  std::map<std::string, Poses> cameras;
  size_t unfit = 0;
  for (const capture::Frame& frame : source.capture.frames) {
    const std::string name = nameBelowRoot(source, frame);
    if (const auto named = matched(options.pattern, name))
      cameras[named->camera].add(source.capture.views[frame.view].camera);
    else
      ++unfit;
  }
  if (cameras.empty())
    throw Error::mismatch("names of pictures such as " +
                              shownText(nameBelowRoot(source, source.capture.frames.front())),
                          shownText(options.pattern))
        .at("--pattern");
  if (options.lampImages.empty()) lights = addLamps(source, options, cameras, progress);

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
    if (!named || (!options.lampImages.empty() && lampNamed(options.lampImages, name))) continue;
    const auto view = views.find(named->camera);
    const auto light = lights.find(named->light);
    if (view == views.end()) {
      ++withoutPose;
    } else if (light == lights.end()) {
      throw Error::mismatch("a light of " + (!options.chromeBall.empty()  ? options.chromeBall.string()
                                             : options.lampImages.empty() ? options.lights.string()
                                                                          : shownText(options.lampImages)),
                            shownText(named->light))
          .at("picture " + shownText(name));
    } else {
      capture.frames.push_back(
          {.view = view->second, .light = light->second, .picture = source.files.at(name)});
    }
  }
  source.notes.push_back(counted(capture.frames.size(), "picture") + " of " +
                         counted(views.size(), "camera") + " by their names, " + shownText(options.pattern) +
                         (options.findLamps ? "" : "; strengths of lights are taken as equal"));
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
void lightByFlash(ForeignCapture& source, const Vec3<double>& offset, bool isFound = false) {
  capture::Capture& capture = source.capture;
  std::vector<Vec3<double>> places;
  for (const capture::View& view : capture.views)
    places.push_back(
        view.camera.cameraFromWorld.inverse()(assume<Point3<CameraSpace, double>>(offset)).raw());
  const float strength = alikeIntensity(places, capture.views);
  for (size_t v = 0; v < places.size(); ++v)
    capture.lights.push_back(lamp("flash " + capture.views[v].identity, places[v], true, strength));
  for (capture::Frame& frame : capture.frames) frame.light = frame.view;
  if (!isFound)
    source.notes.push_back("each photograph is lit by a flash at (" + numberText(offset.x()) + ", " +
                           numberText(offset.y()) + ", " + numberText(offset.z()) +
                           ") from its camera, always of one intensity");
}

// ---------------------------------------------------------------------------------------------------------
// Places from shading.

constexpr size_t kSurfacePoints = 4000, kFlashPhotographs = 96, kLampViews = 8;
constexpr size_t kFewestShades = 50;      // of a lamp
constexpr double kOpen = 0.03;            // share of the mesh in what a point sees
constexpr double kReach = 0.05;           // of the mesh's size, around a point within its pixels
constexpr double kInside = 0.99;          // alpha around a point
constexpr float kClipped = 0.98f;         // of white, in pictures of integers
constexpr double kFits = 0.15;            // median of |log(shown / fitted)|
constexpr double kCertainPlace = 0.05;    // largest standard error of a flash over its distance
constexpr double kCertainDistance = 0.25; // largest standard error of a lamp's distance over itself
constexpr double kCertainDirection = 0.1; // radians

// Share of the light that a surface would reflect, were it lit from everywhere, which comes from the mesh
// itself.
double shareOfMesh(const Vec3<double>& point, const Vec3<double>& normal,
                   const RayCaster<AcquisitionSpace>& caster) {
  constexpr int kRays = 48;
  const Vec3<double> u = normal.unitOrthogonal(), v = normal.cross(u);
  int blocked = 0;
  for (int i = 0; i < kRays; ++i) { // a spiral whose density is the cosine
    const double radius = std::sqrt((i + 0.5) / kRays), angle = 2.399963229728653 * i;
    const Vec3<double> towards =
        radius * std::cos(angle) * u + radius * std::sin(angle) * v + std::sqrt(1 - radius * radius) * normal;
    blocked += caster.occluded(assume<Point3<AcquisitionSpace, double>>(point),
                               assume<Direction3<AcquisitionSpace, double>>(towards), caster.selfHitOffset(),
                               std::numeric_limits<double>::infinity());
  }
  return static_cast<double>(blocked) / kRays;
}

// Points spread evenly over a mesh; only open ones, or the more open half: light from the mesh itself is not
// modelled.
std::vector<Vec3<double>> spreadPoints(const TriangleMesh& mesh, const SmoothNormals& smooth,
                                       const RayCaster<AcquisitionSpace>& caster) {
  double all = 0, below = 0;
  std::vector<Vec3<double>> normals;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) all += areaVector(mesh, t).norm();
  std::vector<Vec3<double>> points;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    below += areaVector(mesh, t).norm();
    while ((static_cast<double>(points.size()) + 0.5) * all < below * static_cast<double>(kSurfacePoints)) {
      // A sequence of low discrepancy in the unit square, folded to the triangle.
      const auto number = static_cast<double>(points.size() + 1);
      double u = std::fmod(0.7548776662466927 * number, 1), v = std::fmod(0.5698402909980532 * number, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto at = [&](size_t corner) -> Vec3<double> {
        return mesh.positions[mesh.triangles[t][corner]].raw().cast<double>();
      };
      points.push_back((1 - u - v) * at(0) + u * at(1) + v * at(2));
      normals.push_back(smooth.at(t, points.back()));
    }
  }
  std::vector<double> shares(points.size());
  tbb::parallel_for(size_t{0}, points.size(),
                    [&](size_t i) { shares[i] = shareOfMesh(points[i], normals[i], caster); });
  const double most = std::max(kOpen, median(shares));
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i)
    if (shares[i] <= most) points[kept++] = points[i];
  points.resize(kept);
  return points;
}

// Frames to estimate from: of a flash evenly chosen ones, of lamps all photographs of some cameras, and of a
// lamp that fewer of them show, further ones.
std::vector<size_t> framesForPlaces(const capture::Capture& capture, bool isFlash) {
  if (isFlash) return evenlySpaced(capture.frames.size(), kFlashPhotographs);
  std::vector<bool> isChosen(capture.views.size());
  for (const size_t view : evenlySpaced(capture.views.size(), kLampViews)) isChosen[view] = true;
  std::vector<size_t> frames, count(capture.lights.size());
  std::vector<std::vector<size_t>> further(capture.lights.size());
  for (size_t f = 0; f < capture.frames.size(); ++f) {
    const capture::Frame& frame = capture.frames[f];
    if (isChosen[frame.view])
      frames.push_back(f), ++count[*frame.light];
    else
      further[*frame.light].push_back(f);
  }
  for (size_t l = 0; l < count.size(); ++l)
    for (const size_t i : evenlySpaced(further[l].size(), kLampViews - std::min(kLampViews, count[l])))
      frames.push_back(further[l][i]);
  std::ranges::sort(frames);
  return frames;
}

// Pixels around a point: bilinear weights of luminance, and of the normals that rays through them meet. None
// at outlines, outside of the matte, and where a pixel is clipped.
std::optional<calibration::ShadedPoint> shadeAt(const capture::Camera<AcquisitionSpace>& camera,
                                                const capture::Photograph& shown, float clipped,
                                                const SmoothNormals& smooth,
                                                const RayCaster<AcquisitionSpace>& caster,
                                                const Vec3<double>& point, double reach) {
  const auto pixel = camera.project(assume<Point3<AcquisitionSpace, double>>(point));
  if (!pixel) return std::nullopt;
  const double x = pixel->x - 0.5, y = pixel->y - 0.5;
  if (!(x >= 0 && y >= 0 && x < shown.radiance.width - 1 && y < shown.radiance.height - 1))
    return std::nullopt;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  double luminance = 0;
  Vec3<double> normal = Vec3<double>::Zero();
  for (int corner = 0; corner < 4; ++corner) {
    const int column = left + corner % 2, row = top + corner / 2;
    const auto texel = shown.radiance.at(column, row);
    if (!(static_cast<double>(shown.alpha.at(column, row)[0]) > kInside) || std::ranges::max(texel) > clipped)
      return std::nullopt;
    const double weight = (corner % 2 ? x - left : 1 - x + left) * (corner / 2 ? y - top : 1 - y + top);
    luminance += weight * static_cast<double>(image::luma({texel[0], texel[1], texel[2]}));
    for (int part = 0; part < 4; ++part) {
      const auto ray = capture::rayThrough(
          camera.lens, {column + 0.25 + 0.5 * (part % 2), row + 0.25 + 0.5 * static_cast<double>(part / 2)});
      if (!ray) return std::nullopt;
      const auto origin = worldFromCamera(ray->origin);
      const auto direction = worldFromCamera(ray->direction);
      const auto hit = caster.firstHit(origin, direction);
      if (!hit) return std::nullopt;
      const Vec3<double> at = origin.raw() + hit->distance * direction.raw();
      if ((at - point).norm() > reach) return std::nullopt;
      const Vec3<double> n = smooth.at(hit->triangle, at);
      normal += weight / 4 * (n.dot(direction.raw()) > 0 ? Vec3<double>(-n) : n);
    }
  }
  if (!(luminance > 0)) return std::nullopt;
  return calibration::ShadedPoint{0, 0, static_cast<float>(luminance), normal.cast<float>()};
}

// Luminances of the mesh's points in the photographs, where the cameras see them.
calibration::ShadedSurface shadedSurface(const capture::Capture& capture, bool isFlash,
                                         const Progress& progress) {
  const TriangleMesh mesh =
      readMesh(capture.folder() / capture.geometry, {.origin = capture.origin}, progress);
  const RayCaster<AcquisitionSpace> caster(mesh, progress);
  const SmoothNormals smooth(mesh, progress);
  const double size = boundsOf(mesh.positions).diagonal().norm();
  calibration::ShadedSurface surface;
  surface.points = spreadPoints(mesh, smooth, caster);
  const std::vector<size_t> frames = framesForPlaces(capture, isFlash);
  for (size_t k = 0; k < frames.size(); ++k) {
    progress("shading", static_cast<double>(k) / static_cast<double>(frames.size()));
    const capture::Frame& frame = capture.frames[frames[k]];
    const capture::Camera<AcquisitionSpace>& camera = capture.views[frame.view].camera;
    const capture::Viewpoint<AcquisitionSpace> viewpoint(camera);
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    calibration::LampPhotograph& photograph = surface.photographs.emplace_back();
    photograph.eye = viewpoint.isDistant() ? Vec3<double>(1e6 * size * viewpoint.place()) : viewpoint.place();
    if (isFlash) {
      photograph.turn = worldFromCamera.rotation();
      photograph.shift = worldFromCamera.translation();
    } else {
      photograph.lamp = *frame.light;
    }
    const capture::Photograph shown =
        std::move(capture::readPhotographs(capture, std::span(&frames[k], 1))[0]);
    const bool mayClip = image::readPictureHeader(capture.folder() / frame.picture).bits > 0;
    const float clipped = mayClip ? kClipped / static_cast<float>(frame.exposure) : capture::kMostStrength;
    std::vector<std::optional<calibration::ShadedPoint>> shades(surface.points.size());
    tbb::parallel_for(size_t{0}, shades.size(), [&](size_t i) {
      shades[i] = shadeAt(camera, shown, clipped, smooth, caster, surface.points[i], kReach * size);
    });
    for (size_t i = 0; i < shades.size(); ++i) {
      if (!shades[i]) continue;
      shades[i]->point = static_cast<uint32_t>(i);
      shades[i]->photograph = static_cast<uint32_t>(k);
      surface.shades.push_back(*shades[i]);
    }
  }
  return surface;
}

// "(0.1, 0.2, -0.05)".
std::string tripleText(const Vec3<double>& v) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g)", v.x(), v.y(), v.z());
  return text;
}

std::string percentText(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g %%", 100 * share);
  return text;
}

// Throws Error where the photographs are not those of a surface of this shape.
void requireFit(const calibration::LampPlace& lamp) {
  if (!(lamp.misfit <= kFits))
    throw Error::mismatch(
        "at most " + percentText(kFits) +
            " between the photographs and a Lambert surface of the mesh (is it the object's?)",
        "a median misfit of " + percentText(lamp.misfit));
}

void placeFlash(ForeignCapture& source, const calibration::ShadedSurface& surface, const Progress& progress) {
  const Vec3<double> atCamera = Vec3<double>::Zero();
  const calibration::LampPlace flash = calibration::lampPlaces(surface, std::span(&atCamera, 1), progress)[0];
  const Vec3<double> middle = surface.middle();
  std::vector<double> distances;
  for (const calibration::LampPhotograph& photograph : surface.photographs)
    distances.push_back((photograph.turn * flash.place + photograph.shift - middle).norm());
  const double distance = median(std::move(distances));
  const double error = flash.standardErrors.norm() / distance;
  const std::string found = tripleText(flash.place) + " from the camera, standard errors " +
                            tripleText(flash.standardErrors) + ", " + percentText(error) +
                            " of its distance from the object";
  requireFit(flash);
  if (!(error <= kCertainPlace))
    throw Error::mismatch("a standard error of at most " + percentText(kCertainPlace) +
                              ": more cameras around the object, or --flash X Y Z",
                          "a flash at " + found);
  capture::Capture& capture = source.capture;
  capture.lights.clear();
  lightByFlash(source, flash.place, true);
  capture.calibration["lights"] = "a flash, estimated from shading at " + found;
  source.notes.push_back("flash found from shading at " + found + "; fits " + counted(flash.shades, "point") +
                         " to " + percentText(flash.misfit) + " in " +
                         counted(surface.photographs.size(), "photograph"));
}

void placeInWorld(ForeignCapture& source, const calibration::ShadedSurface& surface,
                  const Progress& progress) {
  capture::Capture& capture = source.capture;
  const Vec3<double> middle = surface.middle();
  double reach = 0, away = 0;
  for (const Vec3<double>& p : surface.points) reach = std::max(reach, (p - middle).norm());
  for (const capture::View& view : capture.views) away += (view.camera.center().raw() - middle).norm();
  away = std::max(2 * reach, std::min(away / static_cast<double>(capture.views.size()), 10 * reach));
  const auto lamps = calibration::lampPlaces(
      surface, calibration::guessedPlaces(surface, capture.lights.size(), away), progress);
  requireFit(lamps[0]);  // before the cameras are blamed
  double irradiance = 0; // mean at the middle
  for (const calibration::LampPlace& one : lamps)
    irradiance += one.strength / (one.place - middle).squaredNorm() / static_cast<double>(lamps.size());
  size_t far = 0;
  double worstPlace = 0;
  std::vector<std::string> poor;
  for (size_t l = 0; l < lamps.size(); ++l) {
    const calibration::LampPlace& one = lamps[l];
    const Vec3<double> from = one.place - middle;
    const double distance = from.norm();
    if (!(one.errorOfDirection <= kCertainDirection) || one.shades < kFewestShades) {
      poor.push_back(capture.lights[l].name);
      continue;
    }
    const bool isFar = !(one.errorOfDistance <= kCertainDistance);
    far += isFar;
    if (!isFar) worstPlace = std::max(worstPlace, std::hypot(one.errorOfDistance, one.errorOfDirection));
    const double strength = one.strength / irradiance;
    capture.lights[l] = lamp(capture.lights[l].name, isFar ? from : one.place, !isFar,
                             static_cast<float>(isFar ? strength / (distance * distance) : strength));
  }
  if (!poor.empty())
    throw Error("the photographs do not tell where " + counted(poor.size(), "lamp") + " of " +
                std::to_string(lamps.size()) + " stood, to a tenth of a radian (" + firstNames(poor) +
                "): more cameras, or a table");
  const std::string found =
      counted(lamps.size() - far, "lamp") + " at places" +
      (far < lamps.size() ? ", to " + percentText(worstPlace) + " of their distance (standard error)" : "") +
      (far > 0 ? ", and " + counted(far, "lamp") + " as directions, too far away for a place" : "");
  capture.calibration["lights"] = "estimated from shading: " + found;
  source.notes.push_back("found from shading: " + found + "; points fit to " + percentText(lamps[0].misfit) +
                         ", strengths are relative");
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

void giveLights(ForeignCapture& source, const LampOptions& options, const Progress& progress) {
  if (std::ranges::any_of(source.capture.frames,
                          [](const capture::Frame& frame) { return frame.light.has_value(); }))
    throw Error("the source states lights of its own").at(options.pattern.empty() ? "--flash" : "--pattern");
  source.capture.lights.clear(); // no photograph names one
  if (!options.pattern.empty())
    lightByNames(source, options, progress);
  else if (options.findFlash)
    lightByFlash(source, Vec3<double>::Zero(), true);
  else
    lightByFlash(source, *options.flash);
}

void placeLamps(ForeignCapture& source, const LampOptions& options, const Progress& progress) {
  if (!options.findFlash && !options.findLamps) return;
  const std::string option = options.findFlash ? "--flash auto" : "--lights auto";
  if (source.capture.geometry.empty())
    throw Error("shading tells places of lamps only on a known surface: --mesh gives the object's")
        .at(option);
  try {
    const calibration::ShadedSurface surface = shadedSurface(source.capture, options.findFlash, progress);
    options.findFlash ? placeFlash(source, surface, progress) : placeInWorld(source, surface, progress);
  } catch (Error& error) {
    throw std::move(error).at(option);
  }
}

} // namespace surflect::importers
