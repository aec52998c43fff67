#include "srf/import/similarity.h"

#include "srf/capture/rig.h"
#include "srf/import/lamps.h"
#include "srf/import/lit_view.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace surflect::importers {

namespace {

namespace fs = std::filesystem;

using Points = Eigen::Matrix3Xd;

Points columnsOf(std::span<const Vec3<double>> points) {
  Points columns(3, static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = points[i];
  return columns;
}

Similarity fitted(const Points& from, const Points& to) {
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, true);
  const double scale = std::cbrt(matrix.topLeftCorner<3, 3>().determinant());
  return {scale, matrix.topLeftCorner<3, 3>() / scale, matrix.topRightCorner<3, 1>()};
}

double rootMeanSquare(const Points& differences) {
  return std::sqrt(differences.squaredNorm() / static_cast<double>(differences.cols()));
}

Points centred(const Points& points) { return points.colwise() - points.rowwise().mean(); }

// Width of points across the line that fits them best, over their length along it.
double relativeWidth(const Points& points) {
  const Vec3<double> lengths = Eigen::JacobiSVD<Points>(centred(points)).singularValues();
  return lengths[0] > 0 ? lengths[1] / lengths[0] : 0;
}

} // namespace

Rigid<CameraSpace, AcquisitionSpace> moved(const Rigid<CameraSpace, AcquisitionSpace>& cameraFromWorld,
                                           const Similarity& similarity) {
  const Mat3<double> rotation = cameraFromWorld.rotation() * similarity.rotation.transpose();
  const Vec3<double> translation =
      similarity.scale * cameraFromWorld.translation() - rotation * similarity.translation;
  if (!(translation.norm() <= capture::kFarthest))
    throw Error::mismatch("a camera within 1e12 of the origin", "one farther away");
  return {rotation, translation};
}

Similarity similarityBetween(std::span<const Vec3<double>> from, std::span<const Vec3<double>> to) {
  constexpr double kThinnest = 1e-3, kWorst = 0.25;
  if (from.size() < 3)
    throw Error::mismatch("known places of three cameras or more", std::to_string(from.size()));
  const Points source = columnsOf(from), target = columnsOf(to);
  for (const auto& [points, what] : {std::pair(&source, "poses"), {&target, "known places"}})
    if (!(relativeWidth(*points) > kThinnest))
      throw Error(std::string("the ") + what + " are on a line, about which the rest could turn");
  const auto distanceBy = [&](const Points& points) {
    const Similarity similarity = fitted(points, target);
    Points moved = similarity.scale * (similarity.rotation * points);
    moved.colwise() += similarity.translation;
    return rootMeanSquare(moved - target);
  };
  const double distance = distanceBy(source), extent = rootMeanSquare(centred(target));
  if (distanceBy(-source) < distance / 2)
    throw Error("the places fit the mirror image of the poses: an axis is negated, or two are exchanged");
  if (distance > kWorst * extent)
    throw Error::mismatch("places like those of the poses: are names exchanged?",
                          "places " + numberText(distance) + " off after the best fit (root mean square)");
  return fitted(source, target);
}

void moveToPlaces(ForeignCapture& source, const fs::path& table, const std::string& pattern) try {
  capture::Capture& capture = source.capture;
  if (!capture.lights.empty() || !capture.geometry.empty())
    throw Error("the source states lights or a mesh, which places of cameras cannot move");
  std::map<std::string, Vec3<double>> known;
  for (const LightEntry& entry : parseLights(withDecimalPoints(readFile(table))))
    if (entry.name.empty() || !known.emplace(entry.name, entry.vector).second)
      throw Error::mismatch("a name of its own before x y z",
                            entry.name.empty() ? "none" : shownText(entry.name))
          .at("line " + std::to_string(entry.line));

  std::vector<Vec3<double>> posed, places;
  std::vector<std::string> names;
  std::set<std::string> used;
  bool isMatched = pattern.empty();
  for (const capture::Frame& frame : capture.frames) {
    const fs::path name = frame.picture.lexically_relative(source.files.root);
    std::vector<std::string> words{name.generic_string(),
                                   fs::path(name).replace_extension().generic_string()};
    if (!pattern.empty())
      if (const auto named = matched(pattern, name.generic_string())) {
        words.push_back(named->camera);
        isMatched = true;
      }
    for (const std::string& word : words)
      if (const auto place = known.find(word); place != known.end()) {
        posed.push_back(capture.views[frame.view].camera.center().raw());
        places.push_back(place->second);
        names.push_back(word);
        used.insert(word);
        break;
      }
  }
  if (!isMatched)
    throw Error::mismatch("one that fits pictures such as " +
                              shownText(source.files.shown(capture.frames.front().picture)),
                          shownText(pattern))
        .at("--pattern");
  if (posed.empty())
    throw Error::mismatch("names such as " + shownText(source.files.shown(capture.frames.front().picture)),
                          shownText(known.begin()->first));
  const Similarity similarity = similarityBetween(posed, places);
  double squares = 0, farthest = 0, spread = 0;
  std::string which;
  const Vec3<double> middle = columnsOf(places).rowwise().mean();
  for (size_t i = 0; i < posed.size(); ++i) {
    const double distance = (similarity(posed[i]) - places[i]).norm();
    squares += distance * distance;
    spread += (places[i] - middle).squaredNorm();
    if (distance >= farthest) farthest = distance, which = names[i];
  }
  for (capture::View& view : capture.views)
    view.camera.cameraFromWorld = moved(view.camera.cameraFromWorld, similarity);
  const double count = static_cast<double>(posed.size());
  const auto digits = [](double value) { return fmt::format("{:.3g}", value); };
  std::string note = "poses were brought to " + counted(used.size(), "known place") +
                     " of cameras: scaled by " + numberText(similarity.scale) + ", then " +
                     digits(std::sqrt(squares / count)) + " off (root mean square), at most " +
                     digits(farthest) + " (" + which + "), in units of the table";
  if (squares > 0.05 * 0.05 * spread || farthest > 4 * std::sqrt(squares / count))
    note = "warning: " + note + "; is a name or a place wrong?";
  source.notes.push_back(note);
  std::vector<std::string> unused;
  for (const auto& [name, place] : known)
    if (!used.contains(name)) unused.push_back(name);
  if (!unused.empty())
    source.notes.push_back("warning: " + counted(unused.size(), "known place") +
                           " of cameras without a registered picture: " + firstNames(unused));
} catch (Error& error) {
  throw std::move(error).in(table);
}

} // namespace surflect::importers
