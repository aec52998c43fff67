#include "srf/import/ball_lamps.h"

#include "srf/capture/mask_file.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/import/lamps.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace surflect::importers {

namespace {

namespace fs = std::filesystem;
using calibration::Ball;
using calibration::MirrorRay;

// Luminance as stored, which rises with the light, and alpha; pictures without alpha are covered everywhere.
struct BallPicture {
  image::Image luminance, alpha;
  bool hasAlpha = false;
};
BallPicture readBall(const fs::path& path) {
  const image::Picture picture = image::readPicture(path);
  const image::Image& all = picture.image;
  BallPicture ball{image::Image(all.width, all.height, 1), image::Image(all.width, all.height, 1),
                   picture.hasAlpha()};
  const auto alphaAt = static_cast<size_t>(all.channels) - 1;
  for (int y = 0; y < all.height; ++y)
    for (int x = 0; x < all.width; ++x) {
      const auto texel = all.at(x, y);
      ball.luminance.at(x, y)[0] = all.channels >= 3 ? image::luma({texel[0], texel[1], texel[2]}) : texel[0];
      ball.alpha.at(x, y)[0] = ball.hasAlpha ? texel[alphaAt] : 1;
    }
  return ball;
}

// Ball in the camera's axes, of radius 1 if the camera is a pinhole. `mask`: empty for the alpha of the
// picture.
struct SeenBall {
  capture::Lens lens;
  image::Image coverage;
  Ball ball;
};
SeenBall seenBall(capture::Lens lens, const std::optional<fs::path>& mask, const fs::path& picture) {
  const BallPicture shown = readBall(picture);
  SeenBall seen;
  seen.lens = capture::resized(lens, shown.luminance.width, shown.luminance.height);
  const fs::path& from = mask ? *mask : picture;
  if (!mask && !shown.hasAlpha)
    throw Error(
        "the ball has no outline: expected alpha, or a picture named mask beside it, white on the ball")
        .in(picture);
  seen.coverage = mask ? capture::readMask(*mask).coverage : shown.alpha;
  if (seen.coverage.width != shown.luminance.width || seen.coverage.height != shown.luminance.height)
    throw Error::mismatch(sizeText(shown.luminance.width, shown.luminance.height) +
                              ", as the ball's pictures",
                          sizeText(seen.coverage.width, seen.coverage.height))
        .at("size")
        .in(from);
  const auto ball = calibration::ballOfOutline(seen.lens, calibration::outlineOf(seen.coverage));
  if (!ball) throw Error("shows no ball: its outline fits no sphere").in(from);
  seen.ball = *ball;
  return seen;
}

// Ray towards the lamp in the camera's axes; none without a clear highlight.
std::optional<MirrorRay> rayOf(const SeenBall& seen, const Ball& ball, const fs::path& picture) {
  const BallPicture shown = readBall(picture);
  if (shown.luminance.values.size() != seen.coverage.values.size() ||
      shown.luminance.width != seen.coverage.width)
    throw Error::mismatch(sizeText(seen.coverage.width, seen.coverage.height) +
                              ", as other pictures of the ball",
                          sizeText(shown.luminance.width, shown.luminance.height))
        .at("size")
        .in(picture);
  const auto highlight = calibration::highlightOf(shown.luminance, seen.coverage);
  return highlight ? calibration::mirrorRay(seen.lens, ball, *highlight) : std::nullopt;
}

bool isMaskOf(const fs::path& mask, const std::string& camera) {
  return isMaskName(mask) &&
         (mask.parent_path().filename() == camera || mask.stem().string().starts_with(camera));
}

} // namespace

BallLamps lampsOfBall(const fs::path& folder, const std::string& pattern,
                      const std::map<std::string, capture::Camera<AcquisitionSpace>>& cameras) {
  struct View {
    std::vector<std::pair<std::string, fs::path>> pictures; // by light
    std::optional<fs::path> mask;
    SeenBall seen;
  };
  std::map<std::string, View> views;
  const std::vector<fs::path> pictures = picturesBelow(folder);
  for (const fs::path& picture : pictures) {
    const auto named = matched(pattern, picture.lexically_relative(folder).generic_string());
    if (named && cameras.contains(named->camera) && !isMaskOf(picture, named->camera))
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
  }
  std::map<std::string, std::vector<MirrorRay>> rays;
  std::map<std::string, size_t> without;
  for (const auto& [name, view] : views) {
    const auto& pose = cameras.at(name).cameraFromWorld;
    const auto worldFromCamera = pose.inverse();
    Ball inCamera = view.seen.ball;
    if (ball) inCamera = {pose(assume<Point3<AcquisitionSpace, double>>(ball->center)).raw(), ball->radius};
    for (const auto& [light, picture] : view.pictures) {
      rays.try_emplace(light);
      if (const auto ray = rayOf(view.seen, inCamera, picture))
        rays[light].push_back({worldFromCamera(assume<Point3<CameraSpace, double>>(ray->from)).raw(),
                               worldFromCamera(assume<Direction3<CameraSpace, double>>(ray->towards)).raw(),
                               ray->cosine});
      else
        ++without[picture.generic_string()];
    }
  }
  size_t near = 0;
  double spread = 0;
  for (const auto& [light, ofLight] : rays) {
    if (ofLight.empty())
      throw Error("no highlight of light " + shownText(light) + " on the ball in any view").in(folder);
    const calibration::LampOfRays lamp = calibration::lampOfRays(ofLight);
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
                          " of the ball without a clear highlight: " + without.begin()->first);
  return found;
}

std::vector<LightEntry> lampsOfBallInOneView(const fs::path& folder, const capture::Lens& lens) {
  std::vector<fs::path> pictures = picturesIn(folder);
  std::optional<fs::path> mask;
  for (const fs::path& picture : pictures)
    if (isMaskName(picture)) mask = picture;
  std::erase_if(pictures, [](const fs::path& picture) { return isMaskName(picture); });
  if (pictures.empty()) throw Error("no pictures of the ball here").in(folder);
  const SeenBall seen = seenBall(lens, mask, pictures.front());
  std::vector<LightEntry> entries;
  for (const fs::path& picture : pictures) {
    const auto ray = rayOf(seen, seen.ball, picture);
    if (!ray) throw Error("no clear highlight on the ball").in(picture);
    entries.push_back({"", ray->towards, entries.size() + 1});
  }
  return entries;
}

} // namespace surflect::importers
