#include "srf/capture/mask_survey.h"

#include "srf/capture/mask_file.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "surfel/base/evenly_spaced.h"
#include "surfel/base/first_names.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

namespace surflect::capture {

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

bool hasAlpha(const fs::path& picture, const Frame& frame) {
  if (image::formatOf(picture) != image::PictureFormat::exr)
    return image::readPictureHeader(picture).hasAlpha;
  return image::alphaChannel(image::ExrFile(picture),
                             frame.alphaLayer.empty() ? frame.layer : frame.alphaLayer)
      .has_value();
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
      fmt::format("{} of {} masks are labels: their only value above 0, at most half of white, is "
                  "taken for the object: {} ({:.3g} of white)",
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
