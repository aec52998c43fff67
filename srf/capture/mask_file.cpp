#include "srf/capture/mask_file.h"

#include "srf/capture/capture_keys.h"
#include "srf/capture/matte_vote.h"
#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <ranges>
#include <set>
#include <span>
#include <tuple>
#include <utility>

namespace surflect::capture {

namespace {

struct Texel {
  float white = 0, alpha = 1;
};

size_t texelCount(const image::Picture& mask) {
  return static_cast<size_t>(mask.image.width) * static_cast<size_t>(mask.image.height);
}

Texel texelOf(const image::Picture& mask, size_t i) {
  const auto channels = static_cast<size_t>(mask.image.channels);
  const float* values = mask.image.values.data() + i * channels;
  return {channels >= 3 ? image::luma({values[0], values[1], values[2]}) : values[0],
          mask.hasAlpha() ? values[channels - 1] : 1};
}

// Returns whether colours are a mask: nearly all opaque pixels are black or white, and some are white.
// Otherwise the picture is a cut-out of the object, or empty.
bool isStencil(const image::Picture& mask) {
  constexpr float kNear = 0.05f;
  constexpr double kShare = 0.95;
  size_t opaque = 0, white = 0, black = 0;
  for (size_t i = 0; i < texelCount(mask); ++i) {
    const auto [value, alpha] = texelOf(mask, i);
    if (!(alpha > 0.5f)) continue;
    ++opaque;
    white += value > 1 - kNear;
    black += value < kNear;
  }
  return white > 0 && static_cast<double>(white + black) >= kShare * static_cast<double>(opaque);
}

// Stored values of no and of full coverage.
struct Levels {
  float black = 0, white = 1;
};

// Two levels of a mask, as contentOf() states.
Levels levelsOf(std::span<const float> values, int bits, bool lossy) {
  constexpr double kEdges = 0.25; // share of the object; a small one has more edge
  const float tolerance = lossy ? 0.04f : 0;
  const auto [least, largest] = std::ranges::minmax(values);
  if (!(least >= 0 && largest > least)) {
    const bool isOne = bits > 0 && std::round(largest * (std::exp2(bits) - 1)) == 1;
    return {0, isOne && least == largest && !lossy ? largest : 1};
  }
  if (!lossy) {
    const auto isBetween = [&](float value) { return value != least && value != largest; };
    if (least <= 0.5f && std::ranges::none_of(values, isBetween)) return {least, largest};
  }
  if (!(largest > 0.5f && largest < 1 - tolerance)) return {};
  size_t object = 0, edges = 0;
  double sum = 0;
  for (const float value : values) {
    const bool isObject = value >= largest - 2 * tolerance;
    object += isObject;
    edges += !isObject && value > 2 * tolerance;
    if (isObject) sum += value;
  }
  if (static_cast<double>(edges) > kEdges * static_cast<double>(object)) return {};
  return {0, lossy ? static_cast<float>(sum / static_cast<double>(object)) : largest};
}

struct Range {
  float least = std::numeric_limits<float>::infinity(), largest = -least;

  void add(float value) {
    least = std::min(least, value);
    largest = std::max(largest, value);
  }
  // Range of encoded values, "0 to 3 of 255".
  std::string shown(int bits) const {
    if (bits == 0) return numberText(least) + " to " + numberText(largest);
    const double top = std::exp2(bits) - 1;
    return numberText(std::round(least * top)) + " to " + numberText(std::round(largest * top)) + " of " +
           numberText(top);
  }
};

// Returns whether values may be inexact; WebP is lossless only optionally.
bool isLossy(const std::filesystem::path& file) {
  const std::string extension = lowerCase(file.extension().string());
  return extension == ".jpg" || extension == ".jpeg" || extension == ".jpe" || extension == ".webp";
}

image::Picture readLayer(const std::filesystem::path& file, const std::string& layer,
                         const std::string& alphaLayer) {
  if (image::formatOf(file) != image::PictureFormat::exr) return image::readPicture(file);
  const image::ExrFile exr(file);
  image::ChannelSet channels = image::colorChannels(exr, layer);
  if (const auto alpha = image::alphaChannel(exr, alphaLayer.empty() ? layer : alphaLayer))
    channels.push_back(*alpha);
  return {exr.read(channels), 0, true, exr.colorStatement()};
}

} // namespace

MaskContent contentOf(const image::Picture& mask, bool lossy) {
  const auto isOpen = [&](size_t i) { return !(texelOf(mask, i).alpha > 0.5f); };
  const bool hasHoles =
      mask.hasAlpha() && std::ranges::any_of(std::views::iota(size_t{0}, texelCount(mask)), isOpen);
  const bool alphaAlone = hasHoles && !isStencil(mask);
  MaskContent content{image::Image(mask.image.width, mask.image.height, 1)};
  std::vector<float>& values = content.coverage.values;
  for (size_t i = 0; i < values.size(); ++i) {
    const auto [white, alpha] = texelOf(mask, i);
    values[i] = alphaAlone ? alpha : mask.alphaPremultiplied ? white : white * alpha;
  }
  const Levels levels = levelsOf(values, mask.bits, lossy);
  content.white = levels.white;
  if (levels.white < 1 || levels.black > 0)
    for (float& value : values) value = std::min(1.f, (value - levels.black) / (levels.white - levels.black));
  return content;
}

MaskContent readMask(const std::filesystem::path& mask) {
  return contentOf(image::readPicture(mask), isLossy(mask));
}

image::Image readCoverage(const std::filesystem::path& mask, image::PictureSize size) {
  image::Image coverage = readMask(mask).coverage;
  const image::PictureSize found{coverage.width, coverage.height};
  if (found == size) return coverage;
  if (!isResized(found, size))
    throw Error::mismatch(sizeText(size.width, size.height) + " or of that shape",
                          sizeText(found.width, found.height))
        .at("size")
        .in(mask);
  return image::resampled(coverage, {0, 0, found.width, found.height}, size.width, size.height);
}

bool isResized(image::PictureSize a, image::PictureSize b) {
  const double wide = static_cast<double>(a.width) / b.width, high = static_cast<double>(a.height) / b.height;
  const bool isCrop =
      std::max(std::abs(wide - 1), std::abs(high - 1)) < 0.05 || a.width == b.width || a.height == b.height;
  // Smaller and larger size have the same shape if one side is the other, scaled and rounded.
  const auto& [small, large] = a.width < b.width ? std::pair(a, b) : std::pair(b, a);
  const double height = static_cast<double>(large.height) / large.width * small.width,
               width = static_cast<double>(large.width) / large.height * small.height;
  return !isCrop && (std::abs(height - small.height) <= 1 || std::abs(width - small.width) <= 1);
}

std::string describeMatte(const std::filesystem::path& file, const std::string& layer,
                          const std::string& alphaLayer) {
  const image::Picture picture = readLayer(file, layer, alphaLayer);
  Range white, alpha;
  for (size_t i = 0; i < texelCount(picture); ++i) {
    const Texel texel = texelOf(picture, i);
    white.add(texel.white);
    alpha.add(texel.alpha);
  }
  return file.string() + " (" + sizeText(picture.image.width, picture.image.height) + ", values " +
         white.shown(picture.bits) + (picture.hasAlpha() ? ", alpha " + alpha.shown(picture.bits) : "") + ")";
}

bool hasAlpha(const std::filesystem::path& picture, const Frame& frame) {
  if (image::formatOf(picture) != image::PictureFormat::exr)
    return image::readPictureHeader(picture).hasAlpha;
  return image::alphaChannel(image::ExrFile(picture),
                             frame.alphaLayer.empty() ? frame.layer : frame.alphaLayer)
      .has_value();
}

namespace {

namespace fs = std::filesystem;

// A mask file with its pictures.
struct MaskFile {
  fs::path path;
  image::PictureSize pictures, own;
  float white = 1;                     // as in MaskContent
  double inside = 0, insideBorder = 0; // share of object pixels, in all and along the border
};

// Masks of a capture, at most `most`, chosen evenly by name.
std::vector<MaskFile> masksOf(const Capture& capture, size_t most) {
  std::map<fs::path, image::PictureSize> sizes;
  for (const Frame& frame : capture.frames) {
    const Lens& lens = capture.views[frame.view].camera.lens;
    if (!frame.mask.empty()) sizes.try_emplace(frame.mask, image::PictureSize{lens.width, lens.height});
  }
  std::vector<MaskFile> masks;
  const std::vector<std::pair<fs::path, image::PictureSize>> all(sizes.begin(), sizes.end());
  for (const size_t i : evenlySpaced(all.size(), most)) masks.push_back({all[i].first, all[i].second, {}});
  return masks;
}

void measure(MaskFile& mask, const fs::path& folder, bool inverted) {
  const auto [coverage, white] = readMask(folder / mask.path);
  mask.own = {coverage.width, coverage.height};
  mask.white = white;
  const int right = coverage.width - 1, bottom = coverage.height - 1;
  size_t inside = 0, border = 0, insideBorder = 0;
  for (int y = 0; y <= bottom; ++y)
    for (int x = 0; x <= right; ++x) {
      const bool isInside = (coverage.at(x, y)[0] > 0.5f) != inverted;
      const bool isBorder = x == 0 || y == 0 || x == right || y == bottom;
      inside += isInside;
      border += isBorder;
      insideBorder += isInside && isBorder;
    }
  mask.inside = static_cast<double>(inside) / static_cast<double>(coverage.values.size());
  mask.insideBorder = static_cast<double>(insideBorder) / static_cast<double>(border);
}

// Warns of views without mask or alpha, if other views have one.
void warnOfViewsWithout(const Capture& capture, std::vector<std::string>& warnings) {
  std::vector<bool> masked(capture.views.size()), known(capture.views.size());
  for (const Frame& frame : capture.frames)
    if (!frame.mask.empty()) masked[frame.view] = known[frame.view] = true;
  const bool anyMask = std::ranges::find(masked, true) != masked.end();
  bool anyAlpha = false;
  for (const Frame& frame : capture.frames) {
    if (known[frame.view]) continue;
    known[frame.view] = true;
    masked[frame.view] = hasAlpha(capture.folder() / frame.picture, frame);
    anyAlpha |= masked[frame.view];
  }
  std::vector<std::string> without;
  for (size_t v = 0; v < masked.size(); ++v)
    if (!masked[v]) without.push_back(capture.views[v].identity);
  if (without.empty() || without.size() == masked.size()) return;
  warnings.push_back(fmt::format("{}: {} of {} views; {} ({})",
                                 !anyAlpha ? "masks"
                                 : anyMask ? "masks or alpha"
                                           : "alpha",
                                 masked.size() - without.size(), masked.size(),
                                 without.size() == 1
                                     ? "the other one shows all of its picture"
                                     : fmt::format("the other {} show all of their picture", without.size()),
                                 firstNames(without)));
}

// Warns of masks without object, and of captures whose masks have no background.
void warnOfEmpty(const std::vector<MaskFile>& masks, const fs::path& folder,
                 std::vector<std::string>& warnings) {
  std::vector<std::string> empty, full;
  const auto add = [&](std::vector<std::string>& names, const MaskFile& mask) {
    names.push_back(names.size() < 3 ? describeMatte(folder / mask.path)
                                     : ""); // only the first three are described
  };
  for (const MaskFile& mask : masks) {
    if (mask.inside == 0) add(empty, mask);
    if (mask.inside == 1) add(full, mask);
  }
  if (!empty.empty())
    warnings.push_back(
        fmt::format("{} of {} masks show nothing of the object, which is what is brighter than "
                    "half of white: {}",
                    empty.size(), masks.size(), firstNames(empty)));
  if (!full.empty() && full.size() == masks.size())
    warnings.push_back(
        fmt::format("none of {} masks shows any background, which is what is darker than half of "
                    "white: {}",
                    full.size(), firstNames(full)));
}

// Warns of inverted masks: an object usually lies within the picture, so it is rarer along the border.
void warnOfInverted(const std::vector<MaskFile>& masks, std::vector<std::string>& warnings) {
  double white = 0, border = 0;
  size_t telling = 0;
  for (const MaskFile& mask : masks) {
    if (mask.inside == 0 || mask.inside == 1) continue;
    ++telling;
    white += mask.inside;
    border += mask.insideBorder;
  }
  if (telling == 0) return;
  white /= static_cast<double>(telling), border /= static_cast<double>(telling);
  constexpr double kMostlyWhite = 0.6, kLeastBlack = 0.002;
  if (border < kMostlyWhite || 1 - white < kLeastBlack || 1 - border > (1 - white) / 2) return;
  warnings.push_back(fmt::format("masks look inverted: white, which marks the object, covers {:.0f} % of the "
                                 "pictures' borders, but {:.0f} % of the pictures; if black is the object, "
                                 "import with --invert-masks",
                                 100 * border, 100 * white));
}

void noteLabels(const std::vector<MaskFile>& masks, std::vector<std::string>& notes) {
  const auto isLabels = [](const MaskFile& mask) { return mask.white < 1; };
  const auto first = std::ranges::find_if(masks, isLabels);
  if (first == masks.end()) return;
  notes.push_back(
      fmt::format("{} of {} masks have two levels, of which the brighter one is taken for the object, though "
                  "it is below white: {} ({:.3g} of white)",
                  std::ranges::count_if(masks, isLabels), masks.size(), first->path.string(), first->white));
}

void noteResized(const std::vector<MaskFile>& masks, std::vector<std::string>& notes) {
  const auto isOfOtherSize = [](const MaskFile& mask) { return mask.own != mask.pictures; };
  const auto first = std::ranges::find_if(masks, isOfOtherSize);
  if (first == masks.end()) return;
  notes.push_back(
      fmt::format("{} of {} masks have another size than their pictures and are resized to it: {} "
                  "({} x {} for {} x {})",
                  std::ranges::count_if(masks, isOfOtherSize), masks.size(), first->path.string(),
                  first->own.width, first->own.height, first->pictures.width, first->pictures.height));
}

// Identity of a frame's matte.
using MatteKey = std::tuple<fs::path, std::string, fs::path>;

// Frames of each view, one per matte.
std::vector<std::vector<size_t>> framesByMatte(const Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  std::vector<std::optional<bool>> hasOwnAlpha(capture.views.size());
  std::set<std::pair<size_t, MatteKey>> known;
  for (size_t i = 0; i < capture.frames.size(); ++i) {
    const Frame& frame = capture.frames[i];
    std::optional<bool>& own = hasOwnAlpha[frame.view]; // asked of the view's first frame
    if (!own) own = hasAlpha(capture.folder() / frame.picture, frame);
    const std::string& layer = frame.alphaLayer.empty() ? frame.layer : frame.alphaLayer;
    const MatteKey key = *own ? MatteKey(frame.picture, layer, frame.mask) : MatteKey({}, {}, frame.mask);
    if (!*own && frame.mask.empty()) continue;
    if (known.emplace(frame.view, key).second) frames[frame.view].push_back(i);
  }
  return frames;
}

// Matte of a frame, of which the picture or the mask has one.
image::Image matteOf(const Capture& capture, const Frame& frame) {
  const image::Picture picture = readLayer(capture.folder() / frame.picture, frame.layer, frame.alphaLayer);
  image::Image matte(picture.image.width, picture.image.height, 1);
  for (size_t i = 0; i < matte.values.size(); ++i) matte.values[i] = texelOf(picture, i).alpha;
  if (!frame.mask.empty()) {
    const image::Image coverage = readCoverage(capture.folder() / frame.mask, {matte.width, matte.height});
    for (size_t i = 0; i < matte.values.size(); ++i) matte.values[i] *= coverage.values[i];
  }
  return matte;
}

double objectShare(const image::Image& matte) {
  const auto inside = std::ranges::count_if(matte.values, [](float alpha) { return alpha > 0.5f; });
  return static_cast<double>(inside) / static_cast<double>(matte.values.size());
}

// Warns of photographs whose matte is empty, without background, or of another size than their view's.
void warnOfDiffering(const Capture& capture, const Progress& progress, size_t most,
                     std::vector<std::string>& warnings) {
  constexpr double kDifference = 0.1; // of the object
  std::vector<std::vector<size_t>> views = framesByMatte(capture);
  std::erase_if(views, [](const auto& frames) { return frames.size() < 2; });
  const std::vector<size_t> chosen = evenlySpaced(views.size(), most);
  std::vector<std::vector<double>> shares(chosen.size());
  std::vector<double> ofView(chosen.size());
  std::vector<std::vector<size_t>> read(chosen.size());
  for (size_t v = 0; v < chosen.size(); ++v) { // one view at a time: a vote keeps an eighth of the mattes
    const std::vector<size_t>& frames = views[chosen[v]];
    for (const size_t k : evenlySpaced(frames.size(), most)) read[v].push_back(frames[k]);
    MatteVote vote(read[v].size());
    shares[v].resize(read[v].size());
    std::mutex voting;
    tbb::parallel_for(size_t{0}, read[v].size(), [&](size_t k) {
      progress.checkpoint();
      const image::Image matte = matteOf(capture, capture.frames[read[v][k]]);
      shares[v][k] = objectShare(matte);
      const std::lock_guard lock(voting);
      vote.add(matte);
    });
    ofView[v] = objectShare(vote.outcome());
  }
  struct Kind {
    const char* what;
    std::vector<std::string> names = {};
  };
  Kind empty{"empty"}, full{"without background"}, smaller{"more than a tenth smaller"},
      larger{"more than a tenth larger"};
  size_t all = 0;
  for (size_t v = 0; v < chosen.size(); ++v)
    for (size_t k = 0; k < read[v].size(); ++k) {
      ++all;
      const double share = shares[v][k];
      const std::string name = capture.frames[read[v][k]].picture.string();
      if (ofView[v] > 0 && share == 0)
        empty.names.push_back(name);
      else if (ofView[v] < 1 && share == 1)
        full.names.push_back(name);
      else if (share < (1 - kDifference) * ofView[v])
        smaller.names.push_back(name);
      else if (share > (1 + kDifference) * ofView[v])
        larger.names.push_back(name);
    }
  std::string text;
  for (const Kind& kind : {empty, full, smaller, larger})
    if (!kind.names.empty())
      text += fmt::format("{}{} {} ({})", text.empty() ? "" : ", ", kind.names.size(), kind.what,
                          firstNames(kind.names));
  if (!text.empty())
    warnings.push_back(fmt::format("of {} mattes, some are not as those of the same view under other "
                                   "lights: {}; all photographs of a view get one matte, by vote",
                                   all, text));
}

} // namespace

MaskSurvey surveyMasks(const Capture& capture, bool inverted, const Progress& progress, size_t most) {
  std::vector<MaskFile> masks = masksOf(capture, most);
  tbb::parallel_for(size_t{0}, masks.size(), [&](size_t i) {
    progress.checkpoint();
    measure(masks[i], capture.folder(), inverted);
  });
  MaskSurvey survey;
  warnOfViewsWithout(capture, survey.warnings);
  warnOfEmpty(masks, capture.folder(), survey.warnings);
  warnOfInverted(masks, survey.warnings);
  warnOfDiffering(capture, progress, most, survey.warnings);
  noteLabels(masks, survey.notes);
  noteResized(masks, survey.notes);
  return survey;
}

std::optional<std::string> describeFirstMatte(const Capture& capture) {
  for (const Frame& frame : capture.frames) {
    const fs::path file = capture.folder() / (frame.mask.empty() ? frame.picture : frame.mask);
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) continue;
    if (!frame.mask.empty()) return describeMatte(file);
    if (hasAlpha(file, frame)) return describeMatte(file, frame.layer, frame.alphaLayer);
  }
  return std::nullopt;
}

} // namespace surflect::capture
