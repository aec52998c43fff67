#include "srf/import/ball_lamps.h"

#include "srf/capture/mask_file.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/import/lamps.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <numbers>
#include <optional>

namespace surflect::importers {

namespace {

namespace fs = std::filesystem;
using calibration::Ball;
using calibration::MirrorRay;

constexpr double kMostOffBall =
    0.02; // root mean square of an outline's distance from a ball's, over its radius
constexpr double kMostOffAxes = 0.2; // of the axes through the ball of several views, over its radius

image::Picture readBall(const fs::path& path, image::PictureSize size) {
  image::Picture picture = image::readPicture(path);
  if (picture.image.width != size.width || picture.image.height != size.height)
    throw Error::mismatch(sizeText(size.width, size.height) + ", as other pictures of the ball",
                          sizeText(picture.image.width, picture.image.height))
        .at("size")
        .in(path);
  return picture;
}

// Part of a picture from (left, top) on, by one value of each texel.
template <class Value>
image::Image cropped(const image::Image& of, int left, int top, int width, int height, const Value& value) {
  image::Image part(width, height, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) part.at(x, y)[0] = value(of.at(left + x, top + y));
  return part;
}

// Ball in the camera's axes, of radius 1 if the camera is a pinhole. `mask`: empty for the alpha of the
// picture.
struct SeenBall {
  capture::Lens lens; // of the pictures' size
  int left = 0, top = 0;
  image::Image coverage; // of the ball's box in the picture
  Ball ball;
};
SeenBall seenBall(capture::Lens lens, const std::optional<fs::path>& mask, const fs::path& picture) {
  const image::PictureSize size = image::readPictureSize(picture);
  SeenBall seen;
  seen.lens = capture::resized(lens, size.width, size.height);
  const fs::path& from = mask ? *mask : picture;
  image::Image coverage;
  if (mask) {
    coverage = capture::readMask(*mask).coverage;
    if (coverage.width != size.width || coverage.height != size.height)
      throw Error::mismatch(sizeText(size.width, size.height) + ", as the ball's pictures",
                            sizeText(coverage.width, coverage.height))
          .at("size")
          .in(from);
  } else {
    const image::Picture shown = readBall(picture, size);
    if (!shown.hasAlpha())
      throw Error(
          "the ball has no outline: expected alpha, or a picture named mask beside it, white on the ball")
          .in(picture);
    coverage =
        cropped(shown.image, 0, 0, size.width, size.height, [](const auto& texel) { return texel.back(); });
  }
  const auto ball = calibration::ballOfOutline(seen.lens, calibration::outlineOf(coverage));
  if (!ball) throw Error("shows no ball: its outline fits no sphere").in(from);
  if (!(ball->misfit <= kMostOffBall)) {
    char found[64];
    std::snprintf(found, sizeof found, "an outline %.2g %% of the radius off", 100 * ball->misfit);
    throw Error::mismatch("a ball's outline, to 2 % of its radius", found).in(from);
  }
  seen.ball = *ball;
  int right = 0, bottom = 0;
  seen.left = size.width, seen.top = size.height;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      if (!(coverage.at(x, y)[0] > 0.5f)) continue;
      seen.left = std::min(seen.left, x), right = std::max(right, x + 1);
      seen.top = std::min(seen.top, y), bottom = std::max(bottom, y + 1);
    }
  seen.coverage = cropped(coverage, seen.left, seen.top, right - seen.left, bottom - seen.top,
                          [](const auto& texel) { return texel[0]; });
  return seen;
}

// Ray towards the lamp in the camera's axes; none without a clear highlight. Luminance is taken as stored,
// since it rises with the light.
std::optional<MirrorRay> rayOf(const SeenBall& seen, const Ball& ball, const fs::path& picture) {
  const image::Picture shown = readBall(picture, {seen.lens.width, seen.lens.height});
  const bool isColor = shown.image.channels >= 3;
  const auto highlight = calibration::highlightOf(
      cropped(shown.image, seen.left, seen.top, seen.coverage.width, seen.coverage.height,
              [&](const auto& texel) {
                return isColor ? image::luma({texel[0], texel[1], texel[2]}) : texel[0];
              }),
      seen.coverage);
  if (!highlight) return std::nullopt;
  return calibration::mirrorRay(seen.lens, ball, {highlight->x + seen.left, highlight->y + seen.top});
}

// Whether a mask is in the camera's folder, or named as the camera: "C1/mask.png", "C1_mask.png".
bool isMaskOf(const fs::path& mask, const std::string& camera) {
  const std::string stem = mask.stem().string();
  return isMaskName(mask) &&
         (mask.parent_path().filename() == camera ||
          (stem.starts_with(camera) && stem.size() == camera.size() + std::string_view("_mask").size()));
}

} // namespace

BallLamps lampsOfBall(const fs::path& folder, const std::string& pattern,
                      const std::map<std::string, capture::Camera<AcquisitionSpace>>& cameras,
                      const Progress& progress) {
  struct View {
    std::vector<std::pair<std::string, fs::path>> pictures; // by light
    std::optional<fs::path> mask;
    SeenBall seen;
  };
  std::map<std::string, View> views;
  const std::vector<fs::path> pictures = picturesBelow(folder);
  for (const fs::path& picture : pictures) {
    const auto named = matched(pattern, picture.lexically_relative(folder).generic_string());
    if (named && cameras.contains(named->camera) && !isMaskName(picture))
      views[named->camera].pictures.emplace_back(named->light, picture);
  }
  if (views.empty())
    throw Error::mismatch("pictures of the ball whose names fit " + shownText(pattern) +
                              ", of cameras of the capture",
                          counted(pictures.size(), "picture"))
        .in(folder);
  std::vector<capture::Camera<AcquisitionSpace>> placed;
  std::vector<Ball> balls;
  for (auto& [name, view] : views) {
    progress.checkpoint();
    const auto mask = std::ranges::find_if(
        pictures, [&, &camera = name](const fs::path& path) { return isMaskOf(path, camera); });
    if (mask != pictures.end()) view.mask = *mask;
    view.seen = seenBall(cameras.at(name).lens, view.mask, view.pictures.front().second);
    placed.push_back(cameras.at(name));
    balls.push_back(view.seen.ball);
  }
  const bool isPinhole = std::ranges::all_of(
      placed, [](const auto& camera) { return camera.lens.model == capture::Lens::Model::pinhole; });
  std::optional<Ball> ball; // in the world
  BallLamps found;
  if (views.size() > 1 && isPinhole) {
    ball = calibration::ballOfViews(placed, balls);
    if (!ball)
      throw Error("the cameras see the ball from one direction, so that its place is unknown").in(folder);
    found.notes.push_back("mirror ball of radius " + numberText(std::round(ball->radius * 1e4) / 1e4) +
                          " in " + counted(views.size(), "view"));
    if (ball->misfit > kMostOffAxes) {
      char off[128];
      std::snprintf(
          off, sizeof off,
          "warning: the views' axes through the ball miss it by %.2g of its radius, expected at most "
          "%.1g: it moved, or poses are wrong",
          ball->misfit, kMostOffAxes);
      found.notes.emplace_back(off);
    }
  } else if (views.size() > 1) {
    found.notes.emplace_back("cameras without perspective do not tell how far the mirror ball is: lamps have "
                             "directions, no places");
  }
  struct Reflection {
    const View* view;
    const capture::Camera<AcquisitionSpace>* camera;
    const std::string* light;
    const fs::path* picture;
    std::optional<MirrorRay> ray; // in the world
  };
  std::vector<Reflection> reflections;
  for (const auto& [name, view] : views)
    for (const auto& [light, picture] : view.pictures)
      reflections.push_back({&view, &cameras.at(name), &light, &picture, {}});
  size_t done = 0;
  std::mutex reporting;
  tbb::parallel_for(size_t{0}, reflections.size(), [&](size_t i) {
    progress.checkpoint();
    Reflection& one = reflections[i];
    const auto& pose = one.camera->cameraFromWorld;
    const auto worldFromCamera = pose.inverse();
    Ball inCamera = one.view->seen.ball;
    if (ball) inCamera = {pose(assume<Point3<AcquisitionSpace, double>>(ball->center)).raw(), ball->radius};
    if (const auto ray = rayOf(one.view->seen, inCamera, *one.picture))
      one.ray = {worldFromCamera(assume<Point3<CameraSpace, double>>(ray->from)).raw(),
                 worldFromCamera(assume<Direction3<CameraSpace, double>>(ray->towards)).raw(), ray->cosine};
    const std::lock_guard lock(reporting);
    progress("mirror ball", static_cast<double>(++done) / static_cast<double>(reflections.size()));
  });
  std::map<std::string, std::vector<MirrorRay>> rays; // by light
  std::vector<std::string> without;
  for (const Reflection& one : reflections) {
    auto& ofLight = rays[*one.light];
    if (one.ray)
      ofLight.push_back(*one.ray);
    else
      without.push_back(one.picture->lexically_relative(folder).generic_string());
  }
  size_t near = 0;
  double spread = 0;
  for (const auto& [light, ofLight] : rays) {
    if (ofLight.empty())
      throw Error("no highlight of light " + shownText(light) + " on the ball in any view").in(folder);
    const calibration::LampOfRays lamp = calibration::lampOfRays(ofLight, ball.has_value());
    near += lamp.isNear;
    spread = std::max(spread, lamp.spread);
    found.lamps[light] = lamp;
  }
  char angle[32];
  std::snprintf(angle, sizeof angle, "%.2g", spread * 180 / std::numbers::pi);
  found.notes.push_back(
      counted(found.lamps.size(), "lamp") + " by reflections on the ball: " + std::to_string(near) +
      " at places, " + std::to_string(found.lamps.size() - near) + " as directions" +
      (views.size() > 1 ? std::string("; views differ by up to ") + angle + " degrees" : ""));
  if (!without.empty())
    found.notes.push_back("warning: " + counted(without.size(), "picture") +
                          " of the ball without a clear highlight: " + firstNames(without));
  return found;
}

std::vector<LightEntry> lampsOfBallInOneView(const fs::path& folder, const capture::Lens& lens,
                                             const Progress& progress) {
  std::vector<fs::path> pictures = picturesIn(folder);
  std::optional<fs::path> mask;
  for (const fs::path& picture : pictures)
    if (isMaskName(picture)) mask = picture;
  std::erase_if(pictures, [](const fs::path& picture) { return isMaskName(picture); });
  if (pictures.empty()) throw Error("no pictures of the ball here").in(folder);
  const SeenBall seen = seenBall(lens, mask, pictures.front());
  std::vector<std::optional<MirrorRay>> rays(pictures.size());
  tbb::parallel_for(size_t{0}, pictures.size(), [&](size_t i) {
    progress.checkpoint();
    rays[i] = rayOf(seen, seen.ball, pictures[i]);
  });
  std::vector<LightEntry> entries;
  for (size_t i = 0; i < pictures.size(); ++i) {
    if (!rays[i]) throw Error("no clear highlight on the ball").in(pictures[i]);
    entries.push_back({"", rays[i]->towards});
  }
  return entries;
}

} // namespace surflect::importers
