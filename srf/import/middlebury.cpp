#include "srf/import/middlebury.h"

#include "srf/image/image_file.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <cmath>
#include <optional>
#include <set>

namespace surflect::importers {

namespace fs = std::filesystem;

namespace {

Mat3<double> matrixAt(const std::vector<std::string_view>& words, size_t first) {
  Mat3<double> m;
  for (size_t i = 0; i < 9; ++i)
    m(static_cast<int>(i / 3), static_cast<int>(i % 3)) = numberOf(words[first + i]);
  return m;
}

// Lens from the file's K, whose whole numbers are pixel centres; ours are at +0.5.
capture::Lens lensOf(Mat3<double> k, image::PictureSize size) {
  if (k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0 || !(k(2, 2) > 0))
    throw Error::mismatch("an upper triangular matrix with k33 above 0", "another").at("K");
  k /= k(2, 2);
  const double focal = checkedFocalLength(k(0, 0));
  if (!(std::abs(k(0, 1)) <= 1e-6 * focal)) throw Error::mismatch("no skew", numberText(k(0, 1))).at("k12");
  return {.width = size.width,
          .height = size.height,
          .focalX = focal,
          .focalY = checkedFocalLength(k(1, 1)),
          .centerX = checkedCenter(k(0, 2) + 0.5),
          .centerY = checkedCenter(k(1, 2) + 0.5)};
}

void addPicture(ForeignCapture& source, const TextLine& line, capture::RoundedRotations& rotations) {
  const std::vector<std::string_view> words = wordsOf(line.text);
  if (words.size() != 22)
    throw Error::mismatch("a picture, K, R and t: 22 words", std::to_string(words.size()));
  const fs::path picture = source.files.at(words[0]);
  const capture::Lens lens = lensOf(matrixAt(words, 1), image::readPictureSize(picture));
  const Vec3<double> translation(numberOf(words[19]), numberOf(words[20]), numberOf(words[21]));
  source.capture.frames.push_back({.view = source.capture.views.size(), .picture = picture});
  source.capture.views.push_back(
      {std::string(words[0]), {lens, poseFromVisionAxes(matrixAt(words, 10), translation, rotations)}});
}

// Names of pictures with good silhouettes, if the set lists them: dino_par.txt has
// dino_good_silhouette_images.txt beside it.
std::optional<std::set<std::string>> goodSilhouettes(const fs::path& list) {
  std::error_code ignored;
  if (!fs::is_regular_file(list, ignored)) return std::nullopt;
  const std::string content = readFile(list);
  std::set<std::string> names;
  for (const TextLine& line : sayingLinesOf(content)) names.emplace(line.text);
  return names;
}

fs::path silhouetteList(const fs::path& parameters) {
  constexpr std::string_view kEnd = "par.txt";
  std::string name = parameters.filename().string();
  if (name.ends_with(kEnd)) name.resize(name.size() - kEnd.size());
  return parameters.parent_path() / (name + "good_silhouette_images.txt");
}

} // namespace

ForeignCapture readMiddlebury(const fs::path& parameters, bool allowOutside) try {
  const std::string content = readFile(parameters);
  const std::vector<TextLine> lines = sayingLinesOf(content);
  if (lines.empty()) throw Error::mismatch("the number of pictures", "an empty file");
  ForeignCapture source;
  source.files = {parameters.parent_path(), allowOutside};
  capture::RoundedRotations rotations;
  for (size_t i = 0; i < lines.size(); ++i) try {
      if (i > 0)
        addPicture(source, lines[i], rotations);
      else if (countOf(lines[0].text) != lines.size() - 1)
        throw Error::mismatch(std::to_string(lines.size() - 1) + ", as many as lines follow",
                              std::string(lines[0].text));
    } catch (Error& e) {
      throw std::move(e).at(fieldOf(lines[i]));
    }
  if (source.capture.frames.empty()) throw Error("it lists no picture");
  if (const auto good = goodSilhouettes(silhouetteList(parameters)))
    for (const capture::Frame& frame : source.capture.frames)
      if (!good->contains(frame.picture.filename().string())) source.poorSilhouettes.insert(frame.picture);

  std::vector<fs::path> names;
  std::set<std::string> different;
  for (const capture::View& view : source.capture.views) {
    names.emplace_back(view.identity);
    if (!different.insert(view.identity).second) throw Error(shownText(view.identity) + " is listed twice");
  }
  const std::vector<std::string> identities = namesOfPictures(names);
  for (size_t v = 0; v < identities.size(); ++v) source.capture.views[v].identity = identities[v];
  source.notes.push_back("Middlebury: pixel centres moved from whole numbers to +0.5");
  for (std::string& note : rotations.notes()) source.notes.push_back(std::move(note));
  return source;
} catch (Error& e) {
  throw std::move(e).in(parameters);
}

} // namespace surflect::importers
