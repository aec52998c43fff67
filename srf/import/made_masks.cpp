#include "srf/import/made_masks.h"

#include "srf/calibration/segmentation.h"
#include "srf/capture/silhouette.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/image/resize.h"
#include "srf/import/calibrate.h"
#include "srf/import/text.h"
#include "srf/proxy/hull/silhouette_view.h"
#include "srf/proxy/hull/visual_hull.h"
#include "srf/proxy/mesh/mesh_mending.h"
#include "srf/validation/validation.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/geometry/ray_caster.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace surflect::importers {

namespace fs = std::filesystem;

namespace {

constexpr size_t kMostLights = 8; // photographs that are read of a view
constexpr std::array<std::pair<std::string_view, MaskMaking::From>, 4> kWays{
    {{"brightness", MaskMaking::From::brightness},
     {"plate", MaskMaking::From::plate},
     {"key", MaskMaking::From::key},
     {"mesh", MaskMaking::From::mesh}}};

Rgb keyColorOf(std::string_view text) {
  const auto problem = [&] {
    return Error::mismatch("a colour #rrggbb, or r,g,b from 0 to 255", shownText(text));
  };
  std::array<int, 3> codes{};
  if (text.starts_with('#')) {
    if (text.size() != 7) throw problem();
    for (size_t c = 0; c < 3; ++c) {
      const char* begin = text.data() + 1 + 2 * c;
      if (std::from_chars(begin, begin + 2, codes[c], 16).ptr != begin + 2 || *begin == '-') throw problem();
    }
  } else {
    const std::vector<std::string_view> words = wordsOf(text, ",");
    if (words.size() != 3) throw problem();
    for (size_t c = 0; c < 3; ++c) {
      if (!isNumber(words[c]) || words[c].size() > 3) throw problem();
      codes[c] = static_cast<int>(countOf(words[c]));
      if (codes[c] > 255) throw problem();
    }
  }
  const auto linear = [&](size_t c) { return image::linearFromSrgb(static_cast<float>(codes[c]) / 255); };
  return {linear(0), linear(1), linear(2)};
}

std::string hexOf(Rgb color) {
  const float most = std::max({color.r, color.g, color.b, 1.f}); // EXR may exceed 1
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text = "#";
  for (const float value : {color.r, color.g, color.b}) {
    const auto code =
        static_cast<size_t>(std::lround(255 * std::clamp(image::srgbFromLinear(value / most), 0.f, 1.f)));
    text += digits[code / 16];
    text += digits[code % 16];
  }
  return text;
}

std::string percent(double share) { return numberText(std::round(100 * share)) + " %"; }

std::vector<std::vector<size_t>> framesByView(const capture::Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  for (size_t f = 0; f < capture.frames.size(); ++f) frames[capture.frames[f].view].push_back(f);
  return frames;
}

image::Image asCoverage(const image::Mask& mask) {
  image::Image coverage(mask.width, mask.height, 1);
  std::ranges::copy(mask.inside, coverage.values.begin());
  return coverage;
}

bool hasObject(const image::Image& coverage) {
  return std::ranges::any_of(coverage.values, [](float alpha) { return alpha > 0.5f; });
}

// Coverage whose outline, where alpha is 1/2, is moved outwards by `margin` pixels.
image::Image grown(const image::Image& coverage, double margin) {
  if (margin == 0 || !hasObject(coverage)) return coverage;
  const hull::Outline outline(coverage);
  image::Image moved(coverage.width, coverage.height, 1);
  tbb::parallel_for(0, moved.height, [&](int y) {
    for (int x = 0; x < moved.width; ++x)
      moved.at(x, y)[0] =
          static_cast<float>(std::clamp(0.5 + outline.signedDistance({x + 0.5, y + 0.5}) + margin, 0.0, 1.0));
  });
  return moved;
}

// A view's mask, or why there is none.
struct ViewMask {
  image::Image coverage; // one channel; empty: none
  std::string problem;
  image::Image photograph = {}; // one of those that it was made from, if by subtraction
};

// ---------------------------------------------------------------------------------------------------------
// Plates.

class Plates {
public:
  Plates(const fs::path& path, const ForeignCapture& source) : path_(path), source_(source) {
    if (isFile(path)) return;
    if (!isFolder(path)) throw Error::mismatch("a picture, or a folder of pictures", "none").in(path);
    for (const fs::path& picture : picturesBelow(path))
      byName_.emplace(fs::path(picture.lexically_relative(path)).replace_extension().generic_string(),
                      picture);
    if (byName_.empty())
      throw Error::mismatch("plates, pictures named like photographs or cameras", "no picture").in(path);
  }

  // Plate of a frame: the picture itself, or the one of the photograph's path, of its camera, or of the
  // photograph's name. Empty if there is none.
  std::optional<fs::path> of(const capture::Frame& frame) const {
    if (byName_.empty()) return path_;
    fs::path picture = frame.picture.lexically_normal();
    picture.replace_extension();
    for (const std::string& name :
         {picture.lexically_relative(source_.files.root.lexically_normal()).generic_string(),
          source_.capture.views[frame.view].identity, picture.filename().string()})
      if (const auto found = byName_.find(name); found != byName_.end()) return found->second;
    return std::nullopt;
  }

  // Radiance of a plate, read as the frame's photograph is.
  const image::Image& read(const fs::path& plate, const capture::Frame& frame) {
    const capture::Lens& lens = source_.capture.views[frame.view].camera.lens;
    const std::tuple asked(plate, frame.layer, frame.exposure);
    const image::PictureSize size =
        asked == read_ ? image::PictureSize{plate_.width, plate_.height} : image::readPictureSize(plate);
    if (size.width != lens.width || size.height != lens.height)
      throw Error::mismatch(sizeText(lens.width, lens.height) + ", as the photographs of " +
                                source_.capture.views[frame.view].identity,
                            sizeText(size.width, size.height))
          .at("size")
          .in(plate);
    if (asked == read_) return plate_;
    capture::Capture empty;
    empty.colorSpace = source_.capture.colorSpace;
    empty.response = source_.capture.response;
    empty.views = {source_.capture.views[frame.view]};
    empty.frames = {{.view = 0, .picture = plate, .layer = frame.layer, .exposure = frame.exposure}};
    plate_ = radianceOf(empty, 0);
    read_ = asked;
    return plate_;
  }

private:
  fs::path path_;
  const ForeignCapture& source_;
  std::map<std::string, fs::path> byName_; // without extension; empty: path_ is the plate
  // File, layer and exposure of plate_; no file before the first is read.
  std::tuple<fs::path, std::string, double> read_;
  image::Image plate_;
};

// Mask of a view by subtraction. `plateOf(frame, photograph)`: the plate, or null.
template <class PlateOf>
ViewMask subtracted(const capture::Capture& capture, std::span<const size_t> frames,
                    calibration::PlateKind kind, const std::string& without, const PlateOf& plateOf,
                    const Progress& progress) {
  const capture::Lens& lens = capture.views[capture.frames[frames[0]].view].camera.lens;
  std::vector<size_t> chosen, counted;
  for (const size_t i : evenlySpaced(frames.size(), kMostLights)) chosen.push_back(frames[i]);
  calibration::PlateVote vote(lens.width, lens.height);
  double explained = 0;
  bool isAny = false;
  image::Image photograph;
  const image::Image* plate = nullptr;
  for (const size_t frame : chosen) {
    progress.checkpoint();
    photograph = radianceOf(capture, frame);
    plate = plateOf(capture.frames[frame], photograph);
    if (!plate) continue;
    isAny = true;
    const double share = vote.add(photograph, *plate, kind, progress);
    explained = std::max(explained, share);
    if (share >= calibration::PlateVote::kExplained) counted.push_back(frame);
  }
  if (!isAny) return {{}, without};
  if (counted.empty()) return {{}, "the background explains " + percent(explained) + " of the border"};
  const image::Mask object = vote.outcome();
  if (std::ranges::none_of(object.inside, [](uint8_t inside) { return inside != 0; }))
    return {{}, "nothing differs from the background"};
  calibration::EdgeCoverage edges(object);
  for (const size_t frame : counted) {
    progress.checkpoint();
    if (chosen.size() > 1) { // else they are at hand
      photograph = radianceOf(capture, frame);
      plate = plateOf(capture.frames[frame], photograph);
    }
    edges.add(photograph, *plate, kind, progress);
  }
  return {edges.outcome(), "", std::move(photograph)};
}

// ---------------------------------------------------------------------------------------------------------
// Meshes.

// The source's mesh, or else the only one in its folder or in that of the photographs.
fs::path meshBeside(const ForeignCapture& source, const fs::path& sourcePath) {
  if (!source.capture.geometry.empty()) return source.capture.geometry;
  std::set<fs::path> found;
  const fs::path root = source.files.root.lexically_normal(),
                 folderOfSource = isFolder(sourcePath) ? sourcePath : sourcePath.parent_path();
  std::error_code problem;
  std::vector<fs::path> folders{root};
  if (!fs::equivalent(root.empty() ? "." : root, folderOfSource.empty() ? "." : folderOfSource, problem))
    folders.push_back(folderOfSource.lexically_normal());
  for (const fs::path& folder : folders)
    for (fs::directory_iterator entry(folder.empty() ? "." : folder, problem), end; !problem && entry != end;
         entry.increment(problem)) {
      const std::string extension = lowerCase(entry->path().extension().string());
      if ((extension == ".ply" || extension == ".obj") && isFile(entry->path()) && !isHidden(entry->path()))
        found.insert(entry->path());
    }
  if (found.size() == 1) return *found.begin();
  std::vector<std::string> names;
  for (const fs::path& mesh : found) names.push_back(source.files.shown(mesh));
  throw Error::mismatch("one mesh (PLY or OBJ) beside the photographs; --mesh names it",
                        names.empty() ? "none" : firstNames(names))
      .at("--mask-from")
      .in(root);
}

// Share of each pixel that the mesh covers: of 16 rays in pixels at the outline. Parts that are thinner than
// a pixel can be missed.
image::Image coverageOf(const capture::Camera<AcquisitionSpace>& camera,
                        const RayCaster<AcquisitionSpace>& mesh) {
  constexpr int kRays = 4; // each way
  const image::Image centers = capture::silhouette(camera, mesh);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  image::Image coverage = centers;
  tbb::parallel_for(0, coverage.height, [&](int y) {
    for (int x = 0; x < coverage.width; ++x) {
      bool isOutline = false;
      for (int j = std::max(0, y - 1); j <= std::min(coverage.height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(coverage.width - 1, x + 1); ++i)
          isOutline |= centers.at(i, j)[0] != centers.at(x, y)[0];
      if (!isOutline) continue;
      int hits = 0;
      for (int k = 0; k < kRays * kRays; ++k)
        if (const auto ray = capture::rayThrough(
                camera.lens, {x + (k % kRays + 0.5) / kRays, y + (k / kRays + 0.5) / kRays}))
          hits += mesh.firstHit(worldFromCamera(ray->origin), worldFromCamera(ray->direction)).has_value();
      coverage.at(x, y)[0] = static_cast<float>(hits) / (kRays * kRays);
    }
  });
  return coverage;
}

// Reads the mesh, and makes it the capture's geometry.
TriangleMesh meshOf(ForeignCapture& source, const fs::path& sourcePath, const Progress& progress) {
  const fs::path path = meshBeside(source, sourcePath);
  proxy::MendedMesh mesh = proxy::readMended(path, source.capture, progress);
  source.capture.geometry = path;
  source.notes.push_back("the mesh is " + source.files.shown(path) +
                         ", which becomes the capture's geometry");
  for (const std::string& note : mesh.notes) source.notes.push_back(source.files.shown(path) + ": " + note);
  return std::move(mesh.mesh);
}

// ---------------------------------------------------------------------------------------------------------
// Suspicious masks.

// Findings about the masks, each on a list of views: at most 256 pixels a side are kept of a mask.
class Judgement {
public:
  Judgement(std::string way, bool isKeyed) : way_(std::move(way)), isKeyed_(isKeyed) {}

  // `spill`: the key's share of the object's rim.
  void add(const capture::View& view, const ViewMask& mask, double spill) {
    constexpr int kSide = 256;
    constexpr double kEnclosed = 0.01; // of the object's pixels
    constexpr double kSpill = 0.1;
    ++views_;
    if (mask.coverage.values.empty()) {
      without_.push_back(view.identity + " (" + mask.problem + ")");
      return;
    }
    const image::Mask object = image::objectMask(mask.coverage);
    const std::vector<image::Group> groups = image::groupsOf(object, 1, true);
    size_t pixels = 0, pieces = 0, enclosed = 0;
    bool touchesBorder = false;
    for (const image::Group& group : groups) {
      pixels += group.pixels.size();
      touchesBorder |= group.touchesBorder;
    }
    for (const image::Group& group : groups) pieces += 100 * group.pixels.size() > pixels;
    for (const image::Group& hole : image::groupsOf(object, 0, false))
      if (!hole.touchesBorder) enclosed += hole.pixels.size();
    const double share = static_cast<double>(pixels) / static_cast<double>(object.inside.size()),
                 hollow = static_cast<double>(enclosed) / static_cast<double>(std::max<size_t>(pixels, 1));
    least_ = std::min(least_, share), most_ = std::max(most_, share);
    if (touchesBorder) cropped_.push_back(view.identity);
    if (pieces > 1) inPieces_.push_back(view.identity + " (" + std::to_string(pieces) + ")");
    if (spill > kSpill) fringed_.push_back(view.identity + " (" + percent(spill) + ")");
    if (isKeyed_ && hollow > kEnclosed) hollow_.push_back(view.identity + " (" + percent(hollow) + ")");
    const double scale = std::min(1.0, kSide / static_cast<double>(std::max(object.width, object.height)));
    const int width = std::max(1, static_cast<int>(std::lround(scale * object.width))),
              height = std::max(1, static_cast<int>(std::lround(scale * object.height)));
    capture::Camera<AcquisitionSpace> camera = view.camera;
    camera.lens = capture::resized(camera.lens, width, height);
    small_.push_back(
        {view.identity, camera,
         hull::Outline(image::resampled(mask.coverage, {0, 0, object.width, object.height}, width, height))});
  }

  void note(ForeignCapture& source, bool againstHull, const Progress& progress) {
    if (without_.size() == views_)
      throw Error("masks by " + way_ + ": none of " + counted(views_, "view") +
                  " could be segmented: " + firstNames(without_))
          .at("--mask-from")
          .in(source.files.root);
    source.notes.push_back("masks by " + way_ + " for " + std::to_string(views_ - without_.size()) + " of " +
                           counted(views_, "view") + "; the object fills " + percent(least_) +
                           (percent(least_) == percent(most_) ? "" : " to " + percent(most_)) +
                           " of the picture");
    const auto tell = [&](const std::string& text, const std::vector<std::string>& views) {
      if (!views.empty())
        source.notes.push_back(text + " in " + std::to_string(views.size()) + " of " +
                               counted(views_, "view") + ": " + firstNames(views));
    };
    tell("warning: no mask could be made", without_);
    tell("warning: the mask touches the picture's border, as of a cropped object or of background", cropped_);
    tell("warning: the mask is in several pieces", inPieces_);
    tell("warning: the object's rim reflects the key colour (move the screen away, or shrink masks by "
         "--mask-margin)",
         fringed_);
    tell("the key colour shows within the object, through a hole or because the object has it,", hollow_);
    if (againstHull && small_.size() > 1) compareWithHull(source, progress);
  }

private:
  // Compares the masks with their visual hull, which has every silhouette if all masks are right.
  void compareWithHull(ForeignCapture& source, const Progress& progress) {
    constexpr double kVoxelPixels = 2, kBeyond = 0.03; // of the mask's pixels
    std::vector<std::string> odd;
    try {
      const hull::VisualHull hull =
          hull::visualHull(small_, {.voxelPixels = kVoxelPixels}, stepOf(progress, "masks", 0, 1));
      const RayCaster<AcquisitionSpace> caster(hull.mesh, progress);
      for (size_t v = 0; v < small_.size(); ++v) {
        if (std::ranges::binary_search(hull.leftOut, v)) {
          odd.push_back(small_[v].name + " (cuts away what others show)");
          continue;
        }
        const image::Mask inner = image::eroded(small_[v].outline.mask(), static_cast<int>(kVoxelPixels));
        const image::Mask shown = image::objectMask(capture::silhouette(small_[v].camera, caster));
        size_t pixels = 0, beyond = 0;
        for (size_t i = 0; i < inner.inside.size(); ++i) {
          pixels += inner.inside[i];
          beyond += inner.inside[i] && !shown.inside[i];
        }
        const double share = static_cast<double>(beyond) / static_cast<double>(std::max<size_t>(pixels, 1));
        if (share > kBeyond) odd.push_back(small_[v].name + " (" + percent(share) + " outside of it)");
      }
    } catch (const Error& error) {
      source.notes.push_back("warning: the masks have no visual hull: " + std::string(error.what()));
      return;
    }
    if (!odd.empty())
      source.notes.push_back("warning: the mask differs from the visual hull of all in " +
                             std::to_string(odd.size()) + " of " + counted(small_.size(), "view") + ": " +
                             firstNames(odd));
  }

  std::string way_;
  bool isKeyed_;
  size_t views_ = 0;
  double least_ = 1, most_ = 0; // share of the picture
  std::vector<std::string> without_, cropped_, inPieces_, hollow_, fringed_;
  std::vector<hull::SilhouetteView> small_;
};

} // namespace

MaskMaking parseMaskMaking(std::string_view text) {
  const size_t colon = text.find(':');
  const std::string_view word = text.substr(0, colon),
                         value = colon == text.npos ? std::string_view() : text.substr(colon + 1);
  const auto known = std::ranges::find(kWays, word, &decltype(kWays)::value_type::first);
  if (known == kWays.end() || (colon != text.npos && value.empty()) ||
      (colon == text.npos && (word == "brightness" || word == "plate")) ||
      (colon != text.npos && word == "mesh"))
    throw Error::mismatch("brightness:SHARE, plate:PICTURE, plate:FOLDER, key, key:COLOR or mesh",
                          shownText(text));
  MaskMaking making{.from = known->second};
  if (making.from == MaskMaking::From::brightness) {
    making.threshold = numberOf(value);
    if (!(making.threshold >= 0 && making.threshold <= 1))
      throw Error::mismatch("a share from 0 to 1", shownText(value)).at("brightness");
  } else if (making.from == MaskMaking::From::key) {
    if (!value.empty()) making.key = atField("key", [&] { return keyColorOf(value); });
  } else {
    making.path = value;
  }
  return making;
}

void makeMasks(ForeignCapture& source, const fs::path& sourcePath, const MaskMaking& making, Copies& copies,
               const Progress& progress) {
  capture::Capture& capture = source.capture;
  const auto views = framesByView(capture);
  std::string way(std::ranges::find(kWays, making.from, &decltype(kWays)::value_type::second)->first);
  std::optional<Plates> plates;
  std::optional<RayCaster<AcquisitionSpace>> mesh;
  Rgb key = making.key.value_or(Rgb{});
  if (making.from == MaskMaking::From::plate) plates.emplace(making.path, source);
  if (making.from == MaskMaking::From::brightness) way += " above " + numberText(making.threshold);
  if (making.from == MaskMaking::From::plate) way += " " + source.files.shown(making.path);
  if (making.key) way += ", " + hexOf(*making.key);
  if (making.from == MaskMaking::From::mesh) mesh.emplace(meshOf(source, sourcePath, progress), progress);
  if (making.from == MaskMaking::From::mesh) way += " " + source.files.shown(capture.geometry);
  if (making.from == MaskMaking::From::key && !making.key) {
    calibration::BorderColor border;
    for (const auto& frames : views) {
      progress.checkpoint();
      if (!frames.empty()) border.add(radianceOf(capture, frames[0]));
    }
    key = border.color();
    way += ", " + hexOf(key) + " as in " + percent(border.share()) + " of the pictures' borders";
  }
  Judgement judgement(way, making.from == MaskMaking::From::key);
  image::Image plate;
  for (size_t v = 0; v < views.size(); ++v) {
    progress("masks", static_cast<double>(v) / static_cast<double>(views.size()));
    const std::vector<size_t>& frames = views[v];
    if (frames.empty()) continue;
    ViewMask mask;
    switch (making.from) {
    case MaskMaking::From::brightness:
      if (source.poorSilhouettes.contains(capture.frames[frames[0]].picture))
        mask.problem = "its silhouette is not good, as the source's list says";
      else
        mask.coverage = asCoverage(objectOfView(capture, frames, making.threshold, progress));
      break;
    case MaskMaking::From::plate:
      mask = subtracted(
          capture, frames, calibration::PlateKind::photographed, "there is no plate of its name",
          [&](const capture::Frame& frame, const image::Image&) -> const image::Image* {
            const auto file = plates->of(frame);
            return file ? &plates->read(*file, frame) : nullptr;
          },
          progress);
      break;
    case MaskMaking::From::key:
      mask = subtracted(
          capture, frames, calibration::PlateKind::fitted, "less than 20 % of its border have the key colour",
          [&](const capture::Frame&, const image::Image& photograph) -> const image::Image* {
            auto fitted = calibration::fittedPlate(photograph, key);
            if (!fitted) return nullptr;
            plate = *std::move(fitted);
            return &plate;
          },
          progress);
      break;
    case MaskMaking::From::mesh:
      mask.coverage = coverageOf(capture.views[v].camera, *mesh);
      break;
    }
    if (!mask.coverage.values.empty()) {
      mask.coverage = grown(mask.coverage, making.margin);
      if (!hasObject(mask.coverage)) mask = {{}, "the mask is empty"};
    }
    const bool canSpill = making.from == MaskMaking::From::key && !mask.coverage.values.empty();
    judgement.add(capture.views[v], mask,
                  canSpill ? calibration::spillOf(mask.photograph, image::objectMask(mask.coverage), key)
                           : 0);
    if (mask.coverage.values.empty()) continue;
    const fs::path file = copies.replace(capture.frames[frames[0]].picture, "masks", mask.coverage);
    for (const size_t frame : frames) capture.frames[frame].mask = file;
  }
  judgement.note(source, making.from != MaskMaking::From::mesh, progress);
  capture.calibration["masks"] =
      "by " + way + (making.margin == 0 ? "" : ", grown by " + numberText(making.margin) + " pixels");
}

void noteFitOfMesh(ForeignCapture& source, const Progress& progress) {
  capture::Capture used = capture::subset(source.capture, [](const capture::Frame&) { return true; });
  for (capture::Frame& frame : used.frames) frame.mask.clear();
  const proxy::MendedMesh mesh = proxy::readMended(used.geometry, used, progress);
  for (const validation::Finding& finding :
       validation::checkCapture(used, mesh.mesh, validation::kQuickChecks, progress))
    source.notes.push_back(
        (finding.severity == validation::Finding::Severity::error ? "error: " : "warning: ") + finding.text);
}

} // namespace surflect::importers
