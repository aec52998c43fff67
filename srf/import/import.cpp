#include "srf/import/import.h"

#include "srf/calibration/response.h"
#include "srf/capture/mask_file.h"
#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "srf/capture/writer.h"
#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "srf/import/calibrate.h"
#include "srf/import/colmap.h"
#include "srf/import/made_masks.h"
#include "srf/import/masks.h"
#include "srf/import/metashape.h"
#include "srf/import/middlebury.h"
#include "srf/import/output_folder.h"
#include "srf/import/similarity.h"
#include "srf/import/text.h"
#include "srf/import/transforms.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <string_view>
#include <utility>

namespace surflect::importers {

namespace fs = std::filesystem;

void noteTurned(const std::map<fs::path, int>& orientations, ForeignCapture& source) {
  size_t turned = 0;
  std::set<int> different;
  for (const auto& [picture, orientation] : orientations)
    if (orientation != 1) ++turned, different.insert(orientation);
  if (turned == 0) return;
  std::string values;
  for (const int value : different) values += (values.empty() ? "" : ", ") + std::to_string(value);
  source.notes.push_back(
      std::to_string(turned) + " of " + std::to_string(orientations.size()) +
      " photographs carry an EXIF orientation (" + values +
      ") and are taken as they are stored, not turned; poses and light directions must be those "
      "of the stored pictures");
}

void noteUnused(ForeignCapture& source, bool below) {
  std::set<fs::path> folders, used;
  for (const capture::Frame& frame : source.capture.frames) {
    used.insert(frame.mask.lexically_normal());
    for (const capture::Exposure& shot : capture::bracketOf(frame)) {
      used.insert(shot.picture.lexically_normal());
      folders.insert(shot.picture.parent_path());
    }
  }
  std::vector<fs::path> there;
  if (below) there = picturesBelow(source.files.root);
  for (const fs::path& folder : below ? std::set<fs::path>() : folders)
    std::ranges::copy(picturesIn(folder.empty() ? "." : folder), std::back_inserter(there));
  std::vector<std::string> unused;
  for (const fs::path& picture : there) {
    const std::string name = source.files.shown(picture);
    const bool isInMasks = std::ranges::any_of(fs::path(name).parent_path(), [](const fs::path& part) {
      return part == "masks" || part == "mask"; // reported by findMasks
    });
    if (!isInMasks && !used.contains(picture.lexically_normal())) unused.push_back(name);
  }
  if (!unused.empty())
    source.notes.push_back("pictures beside the photographs that are not used: " +
                           std::to_string(unused.size()) + " (" + firstNames(unused) + ")");
}

void noteMasks(ForeignCapture& source, bool inverted, const Progress& progress) {
  const bool anyMask =
      std::ranges::any_of(source.capture.frames, [](const capture::Frame& f) { return !f.mask.empty(); });
  if (inverted && !anyMask) throw Error("the source has no masks").at("--invert-masks").in(source.files.root);
  const auto [warnings, notes] = capture::surveyMasks(source.capture, inverted, progress);
  for (const std::string& warning : warnings) source.notes.push_back("warning: " + warning); // as inspect
  source.notes.insert(source.notes.end(), notes.begin(), notes.end());
  if (inverted) source.notes.push_back("masks were inverted: black is the object");
}

namespace {

std::string formatDefault(int bits) {
  return bits == 0 ? "floating point that states nothing" : std::to_string(bits) + " bits that state nothing";
}

// Interpretation of a picture's colours, and its reason.
std::pair<std::string, std::string> colorsOf(const capture::Capture& capture,
                                             const std::filesystem::path& path) {
  const image::PictureHeader header = image::readPictureHeader(path);
  const auto& stated = header.color;
  const int bits = header.bits;
  if (capture.response) return {"the capture's response curve", "response"};
  const image::ColorEncoding encoding = capture::encodingOf(capture.colorSpace, stated, path);
  std::string word = stated ? stated->source : formatDefault(bits);
  if (capture.colorSpace) word = "color_space" + (stated ? ", over " + stated->source : "");
  return {image::described(encoding, capture::usualTransfer(bits)), word};
}

} // namespace

std::string colorsTaken(const capture::Capture& capture, const Progress& progress) {
  std::map<std::filesystem::path, std::set<std::string>> layersOf; // layers that frames use, by picture
  for (const capture::Frame& frame : capture.frames)
    for (const capture::Exposure& shot : capture::bracketOf(frame))
      layersOf[capture.folder() / shot.picture].insert(shot.layer);
  std::map<std::pair<std::string, std::string>, size_t> counts;
  size_t seen = 0;
  for (const auto& [path, layers] : layersOf) {
    progress("looking at colours", static_cast<double>(seen++) / static_cast<double>(layersOf.size()));
    if (image::formatOf(path) == image::PictureFormat::exr) {
      const image::ExrFile file(path);
      for (const std::string& layer : layers) image::colorChannels(file, layer); // throws if there are none
    }
    ++counts[colorsOf(capture, path)];
  }
  std::string text;
  for (const auto& [colors, count] : counts)
    text += (text.empty() ? "colour: " : ", ") + std::to_string(count) +
            (!text.empty() ? ""
             : count == 1  ? " picture"
                           : " pictures") +
            " as " + colors.first + " (" + colors.second + ")";
  return text;
}

namespace fs = std::filesystem;

namespace {

// Without masks, strengths use pixels brighter than this share of the brightest.
constexpr double kStrengthThreshold = 0.1;

// Formats that may store pixels without compression, of which a lost part looks black.
constexpr std::array<std::string_view, 7> kPlainFormats = {".bmp", ".tif", ".tiff", ".tga",
                                                           ".ppm", ".pgm", ".pnm"};

// The *_par.txt of a folder; throws Error if there are several.
std::optional<fs::path> findParameters(const fs::path& folder) {
  std::optional<fs::path> found;
  std::error_code problem;
  for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    if (!entry->path().filename().string().ends_with("_par.txt") || isHidden(entry->path())) continue;
    if (found)
      throw Error("two parameter files: " + found->filename().string() + " and " +
                  entry->path().filename().string() + "; name one of them")
          .in(folder);
    found = entry->path();
  }
  return found;
}

ForeignCapture readSource(const fs::path& source, ImportFormat format, const ImportOptions& options,
                          const Progress& progress) {
  fs::path folder = isFolder(source) ? source : source.parent_path();
  if (folder.empty()) folder = ".";
  if (!options.chunks.empty() && format != ImportFormat::metashape)
    throw Error("chunks are Metashape's, and the source is not").at("--chunks").in(source);
  switch (format) {
  case ImportFormat::colmap:
    return readColmap(folder, options.images, options.allowOutside);
  case ImportFormat::metashape:
    return readMetashape(isFolder(source) ? source / "cameras.xml" : source,
                         {options.images, options.chunks, options.allowOutside});
  case ImportFormat::transforms:
    return readTransforms(source, options.allowOutside);
  case ImportFormat::middlebury: {
    const auto file = isFolder(source) ? findParameters(source) : source;
    if (!file) throw Error("no *_par.txt here").in(source);
    return readMiddlebury(*file, options.allowOutside);
  }
  case ImportFormat::lights: {
    if (!options.litView.chromeBall.empty() && isFolder(source))
      return readLitView(folder, "", options.litView, options.allowOutside, progress);
    auto file = isFolder(source) ? options.lights : source;
    if (file.empty()) file = findLights(source).value_or("");
    if (file.empty())
      throw Error("no light file (.lp, lights.txt, light_directions.txt) here; --lights says where it is")
          .in(source);
    const bool isOwnFolder = isFolder(source) && !options.lights.empty();
    return readLitView(isOwnFolder ? folder : folderOfPhotographs(file), file, options.litView,
                       options.allowOutside, progress);
  }
  }
  throw Error("unknown format");
}

// ---------------------------------------------------------------------------------------------------------
// Lenses and pictures.

std::string shown(image::PictureSize size) { return sizeText(size.width, size.height); }

// Scales the lens to the size of the pictures, which data sets also distribute as reduced copies, if the
// shape is equal up to rounding to whole pixels. Returns whether it did.
bool fitLens(capture::Lens& lens, image::PictureSize size, int orientation) {
  const image::PictureSize stated{lens.width, lens.height};
  if (size == stated) return false;
  const auto isOfShape = [&](int width, int height) {
    return std::abs(static_cast<double>(lens.height) / lens.width * width - height) <= 1;
  };
  const bool fitsTurned =
      orientation >= 5 && isOfShape(size.height, size.width); // EXIF's 5 to 8 are on the side
  if (!isOfShape(size.width, size.height))
    throw Error::mismatch(shown(stated) + " or of that shape" +
                              (fitsTurned
                                   ? ": EXIF orientation " + std::to_string(orientation) +
                                         " turns the picture to it, but import takes pictures as they are "
                                         "stored; turn the pixels (mogrify -auto-orient), or state lens and "
                                         "poses of the stored picture"
                                   : ""),
                          shown(size))
        .at("size");
  lens = capture::resized(lens, size.width, size.height);
  return true;
}

// Requires one size for all pictures of a view, and its shape for the masks.
void fitLenses(ForeignCapture& source, const Progress& progress) {
  capture::Capture& capture = source.capture;
  std::vector<std::optional<image::PictureSize>> sizes(capture.views.size());
  std::set<fs::path> seen;
  std::map<fs::path, int> orientations; // of photographs
  size_t squares = 0;                   // of them on the side
  size_t shrunken = 0;
  for (size_t f = 0; f < capture.frames.size(); ++f) {
    const capture::Frame& frame = capture.frames[f];
    progress("looking at pictures", static_cast<double>(f) / static_cast<double>(capture.frames.size()));
    std::vector<fs::path> pictures;
    for (const capture::Exposure& exposure : capture::bracketOf(frame)) pictures.push_back(exposure.picture);
    if (!frame.mask.empty()) pictures.push_back(frame.mask);
    for (const fs::path& picture : pictures) try {
        std::optional<image::PictureSize>& ofView = sizes[frame.view];
        if (ofView && !seen.insert(picture).second) continue;
        const image::PictureHeader header = image::readPictureHeader(picture);
        const image::PictureSize size = header.size;
        const bool isMask = picture == frame.mask;
        if (!isMask && orientations.try_emplace(picture, header.orientation).second)
          squares += header.orientation >= 5 && size.width == size.height;
        if (!ofView) shrunken += fitLens(capture.views[frame.view].camera.lens, size, header.orientation);
        if (ofView && *ofView != size && isMask && capture::isResized(size, *ofView)) continue;
        if (ofView && *ofView != size)
          throw Error::mismatch(shown(*ofView) + ", as other pictures of this view", shown(size)).at("size");
        ofView = size;
      } catch (Error& e) {
        throw std::move(e).in(picture);
      }
  }
  if (shrunken > 0)
    source.notes.push_back(std::to_string(shrunken) +
                           " views have pictures of another size than their lens; the lens was resized");
  noteTurned(orientations, source);
  if (squares > 0)
    source.notes.push_back(
        "warning: " + std::to_string(squares) +
        " photographs that EXIF turns on the side are square, so that their size cannot tell whether poses "
        "and masks are those of the turned picture; if they are, turn the pixels first: mogrify "
        "-auto-orient");
}

// ---------------------------------------------------------------------------------------------------------
// Pixels.

// Returns whether the object's pixels are 0 from some pixel on, in the order of the file or of a bottom-up
// one, and hardly any before: as in a picture whose file ends in zeros. Fading shadows do not count.
bool endsInZeros(const image::Image& picture, const image::Image& coverage) {
  constexpr size_t kFewest = 32, kBefore = 16;
  constexpr double kLeastShare = 0.02, kMostDark = 0.05;
  constexpr float kBright = 24.f / 255;
  if (picture.width != coverage.width || picture.height != coverage.height) return false;
  const auto isFull = [&](int x, int y) { return coverage.at(x, y)[0] > 0.99f; };
  for (const bool isBottomUp : {false, true}) {
    std::vector<float> brightness; // of inner pixels
    for (int row = 1; row + 1 < picture.height; ++row)
      for (int x = 1; x + 1 < picture.width; ++x) {
        const int y = isBottomUp ? picture.height - 1 - row : row;
        if (!isFull(x, y) || !isFull(x - 1, y) || !isFull(x + 1, y) || !isFull(x, y - 1) || !isFull(x, y + 1))
          continue;
        const auto texel = picture.at(x, y);
        brightness.push_back(*std::max_element(texel.begin(), texel.begin() + (texel.size() >= 3 ? 3 : 1)));
      }
    const auto isLit = [](float value) { return value > 0; };
    const auto last = std::find_if(brightness.rbegin(), brightness.rend(), isLit);
    const auto lit = static_cast<size_t>(brightness.rend() - last);
    const size_t black = brightness.size() - lit;
    if (lit < kBefore || black < kFewest ||
        static_cast<double>(black) < kLeastShare * static_cast<double>(brightness.size()))
      continue;
    const auto dark =
        std::count(brightness.begin(), brightness.begin() + static_cast<std::ptrdiff_t>(lit), 0.f);
    const auto bright = std::count_if(last, last + kBefore, [](float value) { return value >= kBright; });
    if (static_cast<double>(dark) <= kMostDark * static_cast<double>(lit) &&
        2 * bright >= std::ptrdiff_t{kBefore})
      return true;
  }
  return false;
}

// Returns whether colours of clear pixels are above 0 in more than a tenth of them: colours that are
// multiplied by alpha are 0 there, unless something glows.
bool looksStraight(const image::ExrFile& file, const std::string& layer, const std::string& alphaLayer) {
  const auto alpha = image::alphaChannel(file, alphaLayer.empty() ? layer : alphaLayer);
  if (!alpha) return false;
  image::ChannelSet channels = image::colorChannels(file, layer);
  channels.push_back(*alpha);
  const image::Image image = file.read(channels);
  const auto count = static_cast<size_t>(image.channels);
  size_t clear = 0, colored = 0;
  for (size_t i = 0; i < image.values.size(); i += count) {
    if (image.values[i + count - 1] != 0) continue;
    ++clear;
    colored += *std::max_element(&image.values[i], &image.values[i + count - 1]) > 1e-3f;
  }
  return 10 * colored > clear;
}

// What colours of half-covered pixels are made of: the object's alone, as a format with straight alpha has
// them, the object's times alpha, or a mixture of the object's with white. unclear: too few such pixels, or
// an object too dark or too bright to tell.
enum class EdgeColors { unclear, straight, multiplied, onWhite };

// The closest explanation of half-covered pixels by the colour of an opaque pixel beside them. Another one
// than `straight` must leave less than a quarter of its squared error. White is mixed in either before or
// after encoding.
EdgeColors edgeColorsOf(const image::Image& picture) {
  constexpr int kBeside = 3; // pixels
  constexpr size_t kFewest = 40;
  constexpr double kShare = 0.25;
  const size_t channels = static_cast<size_t>(picture.channels), alphaAt = channels - 1;
  const auto besideOf = [&](int x, int y) -> std::span<const float> {
    for (int reach = 1; reach <= kBeside; ++reach)
      for (int j = std::max(0, y - reach); j <= std::min(picture.height - 1, y + reach); ++j)
        for (int i = std::max(0, x - reach); i <= std::min(picture.width - 1, x + reach); ++i)
          if (picture.at(i, j)[alphaAt] >= 1) return picture.at(i, j);
    return {};
  };
  size_t pixels = 0;
  double straight = 0, multiplied = 0, onWhite = 0, onLinearWhite = 0; // squared errors
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const std::span<const float> pixel = picture.at(x, y);
      const float alpha = pixel[alphaAt];
      if (!(alpha > 0.1f && alpha < 0.9f)) continue;
      const std::span<const float> object = besideOf(x, y);
      if (object.empty()) continue;
      ++pixels;
      const auto add = [&](double& sum, size_t c, float expected) {
        sum += static_cast<double>((pixel[c] - expected) * (pixel[c] - expected));
      };
      for (size_t c = 0; c < alphaAt; ++c) {
        add(straight, c, object[c]);
        add(multiplied, c, alpha * object[c]);
        add(onWhite, c, alpha * object[c] + 1 - alpha);
        add(onLinearWhite, c, image::srgbFromLinear(alpha * image::linearFromSrgb(object[c]) + 1 - alpha));
      }
    }
  if (pixels < kFewest) return EdgeColors::unclear;
  const double white = std::min(onWhite, onLinearWhite);
  if (multiplied < kShare * straight && multiplied <= white) return EdgeColors::multiplied;
  if (white < kShare * straight) return EdgeColors::onWhite;
  return std::min(multiplied, white) > straight ? EdgeColors::straight : EdgeColors::unclear;
}

// Decodes all pictures, each once and several at a time, so that the capture has none that cannot be read.
// Notes pictures that look cut off, and colours that are not multiplied by alpha as their format has it, or
// are mixed with white.
void decodePictures(ForeignCapture& source, bool multipliedIsKnown, const Progress& progress) {
  struct Use {
    fs::path picture, mask;
    std::string layer, alphaLayer;
  };
  std::map<fs::path, Use> uses; // the first of each picture
  for (const capture::Frame& frame : source.capture.frames)
    for (const capture::Exposure& shot : capture::bracketOf(frame))
      uses.try_emplace(shot.picture, Use{shot.picture, frame.mask, shot.layer, shot.alphaLayer});
  std::vector<Use> all;
  for (auto& [path, use] : uses) all.push_back(std::move(use));
  std::vector<char> endsBlack(all.size()), isStraight(all.size());
  std::vector<EdgeColors> edges(all.size(), EdgeColors::unclear);
  std::vector<std::string> parts(all.size());
  size_t done = 0;
  std::mutex reporting;
  tbb::parallel_for(size_t{0}, all.size(), [&](size_t i) {
    progress.checkpoint();
    const auto& [path, mask, layer, alphaLayer] = all[i];
    if (image::formatOf(path) == image::PictureFormat::exr) {
      const image::ExrFile file(path);
      file.decode();
      isStraight[i] = looksStraight(file, layer, alphaLayer);
      if (layer.empty() && !file.parts().empty()) {
        for (const std::string& part : file.parts()) parts[i] += (parts[i].empty() ? "(" : ", ") + part;
        parts[i] += "); taken is " + file.shownPart();
      }
    } else {
      const image::Picture picture = image::readPicture(path);
      const std::string extension = lowerCase(path.extension().string());
      const bool isPlain = std::ranges::find(kPlainFormats, extension) != kPlainFormats.end();
      if (isPlain && !mask.empty())
        endsBlack[i] = endsInZeros(picture.image, capture::readMask(mask).coverage);
      if (picture.hasAlpha() && !picture.alphaPremultiplied) edges[i] = edgeColorsOf(picture.image);
    }
    const std::lock_guard lock(reporting);
    progress("decoding pictures", static_cast<double>(++done) / static_cast<double>(all.size()));
  });
  const auto note = [&](const std::vector<char>& which, const std::string& text) {
    std::vector<std::string> names;
    for (size_t i = 0; i < all.size(); ++i)
      if (which[i]) names.push_back(source.files.shown(all[i].picture));
    if (!names.empty())
      source.notes.push_back("warning: " + std::to_string(names.size()) + " of " +
                             counted(all.size(), "picture") + " " + text + ": " + firstNames(names));
  };
  note(endsBlack, "are black from somewhere within the object on, as after an interrupted copy");
  note(isStraight,
       "have colours where alpha is 0, so their colours look straight; those of an EXR are taken as "
       "multiplied by alpha, and edges come out too bright");
  // Alpha of one photograph may be unusual in itself; that of a set tells how it was made.
  const auto noteEdges = [&](EdgeColors kind, const std::string& text) {
    const auto count = [&](EdgeColors wanted) { return std::ranges::count(edges, wanted); };
    if (2 * count(kind) <= static_cast<std::ptrdiff_t>(all.size()) - count(EdgeColors::unclear)) return;
    std::vector<char> which(all.size());
    for (size_t i = 0; i < all.size(); ++i) which[i] = edges[i] == kind;
    note(which, text);
  };
  if (!multipliedIsKnown)
    noteEdges(EdgeColors::multiplied,
              "have colours that look multiplied by alpha where alpha is below 1, and "
              "edges come out too dark; --fix-premult divides them");
  noteEdges(EdgeColors::onWhite, "have colours that look mixed with white where alpha is below 1, and edges "
                                 "come out too bright; cut out the object with its own colours");
  std::map<std::string, std::vector<std::string>> ofParts;
  for (size_t i = 0; i < all.size(); ++i)
    if (!parts[i].empty()) ofParts[parts[i]].push_back(source.files.shown(all[i].picture));
  for (const auto& [text, names] : ofParts)
    source.notes.push_back(counted(names.size(), "EXR file") + (names.size() > 1 ? " have" : " has") +
                           " several parts " + text + ": " + firstNames(names));
}

// Moves the origin to the middle of a scene that is too far from 0 for float positions.
void bringNear(ForeignCapture& source) {
  const auto origin = capture::nearerOrigin(source.capture);
  if (!origin) return;
  source.capture = capture::countedFrom(std::move(source.capture), *origin);
  const auto coordinate = [&](Eigen::Index axis) { return numberText((*origin)[axis]); };
  source.notes.push_back("coordinates are too large for single precision: cameras and lights count from (" +
                         coordinate(0) + ", " + coordinate(1) + ", " + coordinate(2) +
                         ") now; a script that says coordinates = \"original\" uses those of the source");
}

// ---------------------------------------------------------------------------------------------------------
// Calibration.

// Object mask of a view by its mask; empty if it has none.
std::optional<image::Mask> objectByMatte(const capture::Capture& capture, size_t frame) {
  const capture::Photograph photograph = std::move(capture::readPhotographs(capture, {&frame, 1}).front());
  if (!photograph.hasMatte) return std::nullopt;
  return image::objectMask(photograph.alpha);
}

void estimateStrengths(ForeignCapture& source, bool unevenly, const Progress& progress) {
  capture::Capture& capture = source.capture;
  const auto isDirectional = [](const capture::Light& light) {
    return std::holds_alternative<capture::DirectionalLight>(light.kind);
  };
  if (!source.strengthsUnknown) return;
  if (!std::ranges::all_of(capture.lights, isDirectional)) {
    capture.calibration["light_strengths"] = "unknown, taken as equal";
    source.notes.push_back("light strengths are unknown; one intensity is written for all");
    return;
  }
  std::vector<size_t> frames(capture.frames.size());
  for (size_t f = 0; f < frames.size(); ++f) frames[f] = f;
  std::optional<image::Mask> object = objectByMatte(capture, 0);
  if (!object) object = objectOfView(capture, frames, kStrengthThreshold, progress);
  const StrengthEstimate estimate = strengthsInView(capture, frames, *object, unevenly, progress);
  if (estimate.lights.empty()) { // a flat object or few lights: import anyway
    capture.calibration["light_strengths"] = "unknown, taken as equal";
    source.notes.push_back("light strengths could not be estimated (" + estimate.problem +
                           "); 1 is written for all");
    return;
  }
  for (size_t f = 0; f < frames.size(); ++f)
    capture.lights[*capture.frames[f].light].kind = estimate.lights[f];
  std::string how = "estimated from all " + std::to_string(frames.size()) +
                    " photographs by a Lambert fit; relative, mean 1";
  if (unevenly && estimate.problem.empty()) how += ", with gradients from those that train";
  capture.calibration["light_strengths"] = how;
  source.notes.push_back("light strengths estimated by a Lambert fit");
  if (!estimate.problem.empty())
    source.notes.push_back("how lights fall off over the object could not be estimated (" + estimate.problem +
                           "); they are even");
}

// Removes the source's masks, which need not be valid if others are made.
void dropMasks(ForeignCapture& source) {
  std::set<fs::path> masks;
  for (capture::Frame& frame : source.capture.frames) {
    if (!frame.mask.empty()) masks.insert(frame.mask);
    frame.mask.clear();
  }
  if (!masks.empty())
    source.notes.push_back(counted(masks.size(), "mask") + " of the source " +
                           (masks.size() == 1 ? "is" : "are") + " not used: --mask-from makes others");
}

} // namespace

ImportFormat formatOfSource(const fs::path& source, const ImportOptions& options) {
  if (options.format) return *options.format;
  requireExisting(source);
  std::error_code problem;
  if (!isFolder(source)) {
    if (source.extension() == ".json") return ImportFormat::transforms;
    if (source.extension() == ".xml") return ImportFormat::metashape;
    if (source.filename().string().ends_with("_par.txt")) return ImportFormat::middlebury;
    if (source.extension() == ".lp" || source.extension() == ".txt") return ImportFormat::lights;
  } else {
    if ((!options.lights.empty() || !options.litView.chromeBall.empty()) && !options.lamps.isGiven())
      return ImportFormat::lights;
    if (findTransforms(source)) return ImportFormat::transforms;
    if (!findColmapModels(source).empty()) return ImportFormat::colmap;
    if (isFile(source / "cameras.xml")) return ImportFormat::metashape;
    if (findParameters(source)) return ImportFormat::middlebury;
    if (findLights(source)) return ImportFormat::lights;
    if (fs::directory_iterator(source, problem); problem)
      throw Error("cannot open (" + problem.message() + ")").in(source);
  }
  throw Error(
      "no format known: expected transforms.json (or transforms_train.json), cameras.bin or cameras.txt "
      "(also in sparse/0), cameras.xml of Metashape, *_par.txt, *.lp, lights.txt or light_directions.txt")
      .in(source);
}

void holdOut(capture::Capture& capture, const std::vector<std::string>& names, size_t every) {
  // Cameras in the order of their first frames, and lights, one per cluster.
  std::vector<std::string> cameras, lights;
  std::set<std::string> knownCameras, knownLights;
  for (const capture::View& view : capture.views)
    if (knownCameras.insert(view.identity).second) cameras.push_back(view.identity);
  for (const capture::Light& light : capture.lights)
    if (knownLights.insert(light.identity).second) lights.push_back(light.identity);

  std::set<std::string> outCameras, outLights;
  for (const std::string& name : names) {
    const bool isCamera = knownCameras.contains(name);
    const auto light = std::ranges::find_if(
        capture.lights, [&](const capture::Light& l) { return l.name == name || l.identity == name; });
    if (isCamera) outCameras.insert(name);
    if (light != capture.lights.end()) outLights.insert(light->identity);
    if (isCamera || light != capture.lights.end()) continue;
    std::vector<std::string_view> known(cameras.begin(), cameras.end());
    known.insert(known.end(), lights.begin(), lights.end());
    const std::vector<std::string> all(known.begin(), known.end());
    throw Error::mismatch("a camera or light: " + firstNames(all) + didYouMean(name, known), shownText(name))
        .at("--test");
  }
  const bool ofLights = cameras.size() == 1 && lights.size() > 1;
  const std::vector<std::string>& counted = ofLights ? lights : cameras;
  for (size_t i = 1; every > 0 && i * every <= counted.size(); ++i)
    (ofLights ? outLights : outCameras).insert(counted[i * every - 1]);

  for (capture::Frame& frame : capture.frames)
    if (outCameras.contains(capture.views[frame.view].identity) ||
        (frame.light && outLights.contains(capture.lights[*frame.light].identity)))
      frame.split = capture::Split::test;
  const auto trains = [](const capture::Frame& frame) { return frame.split == capture::Split::train; };
  if (std::ranges::none_of(capture.frames, trains)) throw Error("no photograph is left to train with");
}

ImportReport importCapture(const fs::path& sourcePath, const fs::path& output, const ImportOptions& options,
                           const Progress& progress) {
  ImportReport report;
  report.format = formatOfSource(sourcePath, options);
  OutputFolder folder(output);
  ForeignCapture source = readSource(sourcePath, report.format, options, progress);
  if (!options.cameraPlaces.empty()) moveToPlaces(source, options.cameraPlaces, options.lamps.pattern);
  if (!options.mesh.empty()) source.capture.geometry = options.mesh; // counts in the world of the places
  if (options.lamps.isGiven()) giveLights(source, options.lamps, progress);
  capture::Capture& capture = source.capture;
  if (options.masks) dropMasks(source);
  if (options.colorSpace) {
    capture.colorSpace = options.colorSpace;
    capture.response.reset();
  }
  try {
    holdOut(capture, options.test, options.testEvery);
  } catch (Error& e) {
    throw std::move(e).in(sourcePath);
  }
  if (report.format != ImportFormat::lights && !options.masks) {
    if (source.maskFolders.empty()) source.maskFolders = maskFoldersIn(source.files.root);
    findMasks(source);
  }
  fitLenses(source, progress);
  decodePictures(source, options.fixPremult, progress);
  noteUnused(source, report.format == ImportFormat::colmap || report.format == ImportFormat::metashape);
  if (!options.masks) noteMasks(source, options.invertMasks, progress);
  bringNear(source);
  Copies copies(source.files.root, folder.temporaryPath());
  if (options.invertMasks) invertMasks(capture, copies, progress); // calibration below uses the masks
  if (options.fixPremult) divideByAlpha(capture, copies, progress);
  if (options.recoverResponse) {
    capture.response = calibration::recoverResponse(capture, progress);
    capture.colorSpace.reset();
    capture.calibration["response"] = "recovered from exposure brackets";
  }
  source.notes.push_back(colorsTaken(capture, progress));
  if (options.masks) makeMasks(source, sourcePath, *options.masks, copies, progress);
  placeLamps(source, options.lamps, progress);
  estimateStrengths(source, options.unevenLights, progress);
  if (options.masks && options.masks->from == MaskMaking::From::mesh) noteFitOfMesh(source, progress);

  copyFiles(capture, copies, progress);
  capture::writeCapture(capture, folder.temporaryPath());
  progress("copying", 1);
  folder.commit();

  report.views = capture.views.size();
  report.lights = capture.lights.size();
  for (const capture::Frame& frame : capture.frames)
    ++(frame.split == capture::Split::train ? report.trainingFrames : report.testFrames);
  report.pictures = copies.files("images");
  report.masks = copies.files("masks");
  report.bytes = copies.bytes();
  report.notes = source.notes;
  return report;
}

} // namespace surflect::importers
