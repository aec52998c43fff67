#include "srf/capture/photograph.h"

#include "srf/capture/mask_file.h"
#include "srf/capture/matte_vote.h"
#include "srf/image/bracket.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "surfel/base/error.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/parallel_for_each.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

namespace surflect::capture {

image::Transfer usualTransfer(int bits) {
  return {bits == 8 ? image::Transfer::Curve::srgb : image::Transfer::Curve::linear};
}

image::ColorEncoding encodingOf(const std::optional<ColorSpace>& ofCapture,
                                const std::optional<image::ColorStatement>& ofFile,
                                const std::filesystem::path& picture) {
  if (ofCapture)
    return {image::Transfer{*ofCapture == ColorSpace::srgb ? image::Transfer::Curve::srgb
                                                           : image::Transfer::Curve::linear},
            image::kRec709, nullptr};
  if (!ofFile) return {};
  if (!ofFile->problem.empty())
    throw Error(ofFile->problem + "; color_space of the capture, linear or srgb, would overrule it (import: "
                                  "--color-space)")
        .at(ofFile->source)
        .in(picture);
  return ofFile->encoding;
}

namespace {

// Stored pixels of a picture.
struct Undeveloped {
  image::Image color; // 1 or 3 channels
  std::optional<image::Image> alpha;
  int bits = 0; // bits and flags as in Picture
  bool alphaPremultiplied = false;
  std::optional<image::ColorStatement> stated;
  image::ColorDecoder decoder; // of the colours
  image::Image radiance;       // linear, 3 channels, if an ICC profile decodes the colours; otherwise empty
};

image::Image channelsOf(const image::Image& image, int first, int count) {
  image::Image part(image.width, image.height, count);
  const size_t pixels = part.values.size() / static_cast<size_t>(count);
  for (size_t i = 0; i < pixels; ++i)
    std::copy_n(image.values.begin() + static_cast<std::ptrdiff_t>(i) * image.channels + first, count,
                part.values.begin() + static_cast<std::ptrdiff_t>(i) * count);
  return part;
}

Undeveloped split(const image::Picture& picture) {
  const int channels = picture.image.channels, colors = picture.hasAlpha() ? channels - 1 : channels;
  Undeveloped parts{channelsOf(picture.image, 0, colors),
                    {},
                    picture.bits,
                    picture.alphaPremultiplied,
                    picture.color,
                    {},
                    {}};
  if (picture.hasAlpha()) parts.alpha = channelsOf(picture.image, colors, 1);
  return parts;
}

// Reads the layers of one EXR in a single pass.
std::vector<Undeveloped> readLayers(const std::filesystem::path& path, const std::vector<Exposure>& shots,
                                    const Progress& progress) {
  const image::ExrFile file(path);
  std::vector<image::ChannelSet> sets; // per shot: colour, then alpha if there is one
  std::vector<bool> hasAlpha;
  for (const Exposure& shot : shots) {
    sets.push_back(image::colorChannels(file, shot.layer));
    const auto alpha = image::alphaChannel(file, shot.alphaLayer.empty() ? shot.layer : shot.alphaLayer);
    if (!alpha && !shot.alphaLayer.empty())
      throw Error::mismatch("a channel A", "none").at("layer " + shot.alphaLayer).in(path);
    hasAlpha.push_back(alpha.has_value());
    if (alpha) sets.push_back({*alpha});
  }
  const std::optional<image::ColorStatement> stated = file.colorStatement();
  std::vector<image::Image> images = file.read(sets, progress);
  std::vector<Undeveloped> layers;
  auto next = images.begin();
  for (const bool withAlpha : hasAlpha) {
    Undeveloped& layer = layers.emplace_back(Undeveloped{std::move(*next++), {}, 0, true, stated, {}, {}});
    if (withAlpha) layer.alpha = std::move(*next++);
  }
  return layers;
}

// Brings alpha into 0..1, before colours are divided by it. Filters with negative lobes overshoot the range
// somewhat; what lies farther out is a picture of another scale, and an Error.
void clampAlpha(image::Image& alpha, const std::filesystem::path& path) {
  constexpr float kOvershoot = 0.25f;
  for (size_t i = 0; i < alpha.values.size(); ++i) {
    float& value = alpha.values[i];
    if (!std::isfinite(value)) continue; // an invalid texel
    if (value < -kOvershoot || value > 1 + kOvershoot) {
      const size_t width = static_cast<size_t>(alpha.width);
      throw Error::mismatch(
          "0 to 1",
          fmt::format("{} at pixel ({}, {})", numberText(static_cast<double>(value)), i % width, i / width))
          .at("alpha")
          .in(path);
    }
    value = std::clamp(value, 0.f, 1.f);
  }
}

// Pictures of all shots that use the file. Throws Error for alpha that is far outside 0..1.
std::vector<Undeveloped> readShared(const std::filesystem::path& path, const std::vector<Exposure>& shots,
                                    const Progress& progress) {
  if (image::formatOf(path) == image::PictureFormat::exr) {
    std::vector<Undeveloped> layers = readLayers(path, shots, progress);
    for (Undeveloped& layer : layers)
      if (layer.alpha) clampAlpha(*layer.alpha, path);
    return layers;
  }
  for (const Exposure& shot : shots)
    if (!shot.layer.empty() || !shot.alphaLayer.empty())
      throw Error("only .exr files have layers").at("layer " + shot.layer + shot.alphaLayer).in(path);
  Undeveloped picture = split(image::readPicture(path));
  if (picture.alpha) clampAlpha(*picture.alpha, path); // floats of TIFF
  return std::vector<Undeveloped>(shots.size(), std::move(picture));
}

void checkSize(const image::Image& image, const Lens& lens, const std::filesystem::path& path) {
  if (image.width != lens.width || image.height != lens.height)
    throw Error::mismatch(sizeText(lens.width, lens.height), sizeText(image.width, image.height))
        .at("size")
        .in(path);
}

float unit(float value) { return value > 0 ? std::min(value, 1.f) : 0; } // NaN is 0

// Stored colour divided by alpha above 0.
float straight(const Undeveloped& picture, size_t pixel, size_t channel) {
  const auto channels = static_cast<size_t>(picture.color.channels);
  const float stored = picture.color.values[pixel * channels + (channels == 3 ? channel : 0)];
  return picture.alphaPremultiplied && picture.alpha ? stored / picture.alpha->values[pixel] : stored;
}

// Decodes the stored values of a capture's pictures.
class Encoding {
public:
  explicit Encoding(const Capture& capture) : capture_(capture) {}

  // Sets a picture's decoder. Throws Error naming it.
  void settle(Undeveloped& picture, const std::filesystem::path& path) const {
    if (capture_.response && picture.bits != 8)
      throw Error::mismatch("8 bits, as the capture has a response curve",
                            picture.bits ? std::to_string(picture.bits) + " bits" : "floating point")
          .in(path);
    if (capture_.response) return;
    picture.decoder = {encodingOf(capture_.colorSpace, picture.stated, path), usualTransfer(picture.bits)};
    if (picture.decoder.profile()) picture.radiance = decodedByProfile(picture);
  }
  // Linear value of one channel, before channels are mixed. Not for pictures with a profile.
  float linear(const Undeveloped& picture, float stored, size_t channel) const {
    return capture_.response ? (*capture_.response)(channel, stored) : picture.decoder.linear(stored);
  }

private:
  static image::Image decodedByProfile(const Undeveloped& picture) {
    image::Image colors = picture.color;
    const auto channels = static_cast<size_t>(colors.channels);
    for (size_t i = 0; i < colors.values.size(); ++i)
      colors.values[i] = straight(picture, i / channels, i % channels);
    return image::decoded(colors, picture.decoder);
  }

  const Capture& capture_;
};

// Clipping level of a camera: the largest colour of object pixels in a bracket.
float largestColor(std::span<const Undeveloped> bracket) {
  float largest = 0;
  for (const Undeveloped& picture : bracket)
    for (size_t i = 0; i < picture.color.values.size(); ++i) {
      const auto channels = static_cast<size_t>(picture.color.channels);
      if (picture.alpha && !(picture.alpha->values[i / channels] > 0.5f)) continue;
      if (const float value = straight(picture, i / channels, i % channels); std::isfinite(value))
        largest = std::max(largest, value);
    }
  return largest;
}

// Exposures are merged per channel, which requires equal primaries.
void checkMixing(std::span<const Undeveloped> bracket, const std::filesystem::path& path) {
  for (const Undeveloped& picture : bracket)
    if (!havePrimariesInCommon(picture.decoder, bracket[0].decoder))
      throw Error::mismatch("one statement of primaries in the pictures of a bracket", "different ones")
          .in(path);
}

// Stored value that weighs a pixel decoded by a profile. A profile mixes channels, so the worst channel
// counts: NaN first, then clipped, then black.
float leastTrusted(const Undeveloped& picture, size_t pixel, float zMax) {
  float worst = straight(picture, pixel, 0);
  for (size_t c = 0; c < 3; ++c) {
    const float z = straight(picture, pixel, c);
    if (!std::isfinite(z)) return NAN;
    const float weight = image::hatWeight(z, 0, zMax), least = image::hatWeight(worst, 0, zMax);
    if (weight < least || (weight == least && z > worst)) worst = z;
  }
  return worst;
}

// Merges a bracket: pictures of one size with their exposures. `matte` replaces alpha and coverage. Only the
// rows of the part are developed; it does not shrink.
Photograph develop(std::span<const Undeveloped> bracket, std::span<const Exposure> shots,
                   const image::Image* coverage, const Encoding& encoding, const image::Image* matte,
                   const ViewPart& part) {
  const Undeveloped& first = bracket[0];
  const int width = first.color.width, height = part.rows > 0 ? part.rows : first.color.height - part.top;
  const size_t before = static_cast<size_t>(part.top) * static_cast<size_t>(width);
  Photograph photograph{image::Image(width, height, 3), image::Image(width, height, 1)};
  photograph.hasMatte = first.alpha || coverage;
  const float zMax = bracket.size() > 1 ? largestColor(bracket) : 0;
  std::vector<image::ExposureSample> samples(bracket.size());
  const bool isCoded = first.bits > 0 || coverage; // floating point may mean what it says

  for (size_t texel = 0; texel < photograph.alpha.values.size(); ++texel) {
    const size_t i = before + texel; // in the pictures
    const float pictureAlpha = first.alpha ? first.alpha->values[i] : 1;
    const float own = unit(pictureAlpha) * (coverage ? unit(coverage->values[i]) : 1);
    const float alpha = matte ? matte->values[i] : isCoded ? settledAlpha(own) : own;
    photograph.alpha.values[texel] = alpha;
    bool valid = std::isfinite(pictureAlpha);
    float* radiance = photograph.radiance.values.data() + 3 * texel;
    const bool hasColor =
        alpha > 0 && (!matte || !first.alphaPremultiplied || settledAlpha(pictureAlpha) > 0);
    for (size_t c = 0; c < 3 && hasColor; ++c) {
      for (size_t k = 0; k < bracket.size(); ++k) {
        const float z = straight(bracket[k], i, c);
        const image::Image& byProfile = bracket[k].radiance;
        const bool isNumber = std::isfinite(z);
        const float linear = byProfile.values.empty() || !isNumber ? encoding.linear(bracket[k], z, c)
                                                                   : byProfile.values[3 * i + c];
        const bool isMixed = bracket.size() > 1 && !byProfile.values.empty();
        const float weighed = isMixed ? leastTrusted(bracket[k], i, zMax) : z;
        samples[k] = {isNumber ? weighed : NAN, linear, static_cast<float>(shots[k].exposure)};
      }
      radiance[c] = bracket.size() > 1 ? image::mergedRadiance(samples, zMax)
                                       : samples[0].exposure * static_cast<float>(1 / shots[0].exposure);
      valid = valid && std::isfinite(radiance[c]);
    }
    if (first.color.channels == 3) first.decoder.toRec709(radiance);
    if (valid) continue;
    std::fill_n(radiance, 3, 0.f);
    photograph.invalidTexels.push_back(texel);
  }
  return photograph;
}

// State of a frame's photograph while its files are read.
struct Development {
  std::vector<Exposure> shots;
  std::vector<Undeveloped> bracket; // one per shot, once it is read
  std::atomic<size_t> missing;      // number of shots still to be read
};

// A mask in the size of the view's pictures; views of several sizes may share a file.
struct MaskKey {
  std::filesystem::path file;
  int width = 0, height = 0;

  MaskKey(const Capture& capture, const Frame& frame)
      : file(frame.mask), width(capture.views[frame.view].camera.lens.width),
        height(capture.views[frame.view].camera.lens.height) {}
  auto operator<=>(const MaskKey&) const = default;
};

std::map<MaskKey, image::Image> readMasks(const Capture& capture, std::span<const size_t> frames,
                                          const Progress& progress) {
  std::map<MaskKey, image::Image> masks;
  for (const size_t frame : frames)
    if (!capture.frames[frame].mask.empty()) masks[{capture, capture.frames[frame]}];
  tbb::parallel_for_each(masks, [&](auto& entry) {
    progress.checkpoint();
    const auto& [file, width, height] = entry.first;
    entry.second = readCoverage(capture.folder() / file, {width, height});
  });
  return masks;
}

// Number of pictures of a capture's largest lens that are read at the same time.
size_t picturesAtOnce(const Capture& capture) {
  double pixels = 1;
  for (const View& view : capture.views)
    pixels = std::max(pixels, 1.0 * view.camera.lens.width * view.camera.lens.height);
  return static_cast<size_t>(
      std::clamp(readingBytes() / (kBytesWhileRead * pixels), 1.0, 1.0 * tbb::info::default_concurrency()));
}

Photograph shrunk(const Photograph& photograph, int shrink);

// Reads several files at a time, each once, in the order of the frames that need them. Calls take(i,
// photograph) for the i-th frame when all its pictures are read; one at a time, in any order. The part's
// matte replaces those of the photographs.
template <class Take>
void developAll(const Capture& capture, std::span<const size_t> frames, const Progress& progress,
                const Take& take, const ViewPart& part = {}) {
  struct Place {
    size_t frame, shot; // positions in `frames`, and in its bracket
  };
  struct File {
    std::filesystem::path name;
    std::vector<Place> places;
  };
  std::vector<File> files;
  std::map<std::filesystem::path, size_t> numbers; // of the files
  std::vector<Development> developments(frames.size());
  for (size_t i = 0; i < frames.size(); ++i) {
    assert(frames[i] < capture.frames.size());
    auto& [shots, bracket, missing] = developments[i];
    shots = bracketOf(capture.frames[frames[i]]);
    bracket.resize(shots.size());
    missing = shots.size();
    for (size_t k = 0; k < shots.size(); ++k) {
      const auto [known, isNew] = numbers.try_emplace(shots[k].picture, files.size());
      if (isNew) files.push_back({shots[k].picture, {}});
      files[known->second].places.push_back({i, k});
    }
  }
  const Encoding encoding(capture);
  const image::Image* const matte = part.matte;
  const auto masks = matte ? std::map<MaskKey, image::Image>() : readMasks(capture, frames, progress);
  std::mutex taking;

  const auto developIfComplete = [&](size_t i) {
    auto& [shots, bracket, missing] = developments[i];
    if (--missing > 0) return;
    const Frame& frame = capture.frames[frames[i]];
    const image::Image* coverage = frame.mask.empty() || matte ? nullptr : &masks.at({capture, frame});
    checkMixing(bracket, capture.folder() / frame.picture);
    Photograph photograph = develop(bracket, shots, coverage, encoding, matte, part);
    bracket.clear(); // frees its memory
    if (part.shrink > 1) photograph = shrunk(photograph, part.shrink);
    const std::lock_guard lock(taking);
    take(i, std::move(photograph));
  };
  const auto readFile = [&](const File& file) {
    progress.checkpoint();
    const auto& [name, places] = file;
    std::vector<Exposure> sharing;
    for (const auto [i, k] : places) sharing.push_back(developments[i].shots[k]);
    const std::filesystem::path path = capture.folder() / name;
    std::vector<Undeveloped> pictures = readShared(path, sharing, progress);
    for (size_t p = 0; p < places.size(); ++p) {
      progress.checkpoint();
      const auto [i, k] = places[p];
      checkSize(pictures[p].color, capture.views[capture.frames[frames[i]].view].camera.lens, path);
      encoding.settle(pictures[p], path);
      developments[i].bracket[k] = std::move(pictures[p]);
      developIfComplete(i);
    }
  };
  size_t begun = 0;
  const auto begin = [&](tbb::flow_control& control) {
    if (begun == files.size()) {
      control.stop();
      return size_t{0};
    }
    return begun++;
  };
  tbb::parallel_pipeline(
      picturesAtOnce(capture),
      tbb::make_filter<void, size_t>(tbb::filter_mode::serial_in_order, begin) &
          tbb::make_filter<size_t, void>(tbb::filter_mode::parallel, [&](size_t i) { readFile(files[i]); }));
}

} // namespace

double readingBytes() {
  constexpr double kLeast = 2.5e9, kShare = 0.1;
  return std::max(kLeast, kShare * static_cast<double>(availableMemory()));
}

std::vector<Photograph> readPhotographs(const Capture& capture, std::span<const size_t> frames,
                                        const Progress& progress) {
  std::vector<Photograph> photographs(frames.size());
  developAll(capture, frames, progress,
             [&](size_t i, Photograph photograph) { photographs[i] = std::move(photograph); });
  return photographs;
}

namespace {

// Least alpha of the view's matte at which a photograph should have a colour.
constexpr float kFaintest = 1 / 16.f;

// Photographs whose own matte is clear where the view's is not.
std::vector<size_t> lackingColors(std::span<const std::vector<bool>> clear, const image::Image& matte) {
  std::vector<size_t> lacking;
  for (size_t i = 0; i < clear.size(); ++i)
    for (size_t texel = 0; texel < clear[i].size(); ++texel)
      if (clear[i][texel] && matte.values[texel] >= kFaintest) {
        lacking.push_back(i);
        break;
      }
  return lacking;
}

} // namespace

Lens shrunk(const Lens& lens, int shrink) {
  Lens small = lens;
  small.width = (lens.width + shrink - 1) / shrink, small.height = (lens.height + shrink - 1) / shrink;
  small.focalX /= shrink, small.centerX /= shrink;
  small.focalY /= shrink, small.centerY /= shrink;
  return small;
}

namespace {

// The mean alpha of shrink x shrink pixels, and the mean of their colours weighted by alpha.
Photograph shrunk(const Photograph& photograph, int shrink) {
  const image::Image& alpha = photograph.alpha;
  const int width = (alpha.width + shrink - 1) / shrink, height = (alpha.height + shrink - 1) / shrink;
  Photograph small{image::Image(width, height, 3), image::Image(width, height, 1), photograph.hasMatte,
                   photograph.invalidTexels};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int right = std::min(alpha.width, (x + 1) * shrink),
                bottom = std::min(alpha.height, (y + 1) * shrink);
      float covered = 0, count = 0;
      std::array<float, 3> sum{};
      for (int row = y * shrink; row < bottom; ++row)
        for (int column = x * shrink; column < right; ++column) {
          const float a = alpha.at(column, row)[0];
          const auto color = photograph.radiance.at(column, row);
          for (size_t c = 0; c < 3; ++c) sum[c] += a * color[c];
          covered += a;
          ++count;
        }
      small.alpha.at(x, y)[0] = covered / count;
      if (covered > 0)
        for (size_t c = 0; c < 3; ++c) small.radiance.at(x, y)[c] = sum[c] / covered;
    }
  return small;
}

// Adds the masks of frames whose pictures have no alpha; returns whether there are any.
bool addMasks(const Capture& capture, std::span<const size_t> frames, const Progress& progress,
              MatteVote& vote) {
  std::map<MaskKey, size_t> uses; // number of frames that have a mask
  for (const size_t frame : frames)
    if (!capture.frames[frame].mask.empty()) ++uses[{capture, capture.frames[frame]}];
  std::mutex voting;
  tbb::parallel_for_each(uses, [&](const auto& entry) {
    progress.checkpoint();
    const auto& [file, width, height] = entry.first;
    image::Image coverage = readCoverage(capture.folder() / file, {width, height});
    for (float& alpha : coverage.values) alpha = settledAlpha(unit(alpha));
    const std::lock_guard lock(voting);
    for (size_t i = 0; i < entry.second; ++i) vote.add(coverage);
  });
  return !uses.empty();
}

} // namespace

std::optional<image::Image> readViewMatte(const Capture& capture, std::span<const size_t> frames,
                                          const Progress& progress) {
  if (!describeFirstMatte(capture)) return std::nullopt;
  MatteVote vote(frames.size());
  const auto isWithAlpha = [&](size_t i) {
    const Frame& frame = capture.frames[i];
    return hasAlpha(capture.folder() / bracketOf(frame)[0].picture, frame);
  };
  bool hasMatte = false;
  if (std::ranges::none_of(frames, isWithAlpha))
    hasMatte = addMasks(capture, frames, progress, vote);
  else
    developAll(capture, frames, progress, [&](size_t, const Photograph& photograph) {
      if (photograph.hasMatte) vote.add(photograph.alpha);
      hasMatte |= photograph.hasMatte;
    });
  return hasMatte ? std::optional(vote.outcome()) : std::nullopt;
}

ViewPhotographs readViewPart(const Capture& capture, std::span<const size_t> frames, const ViewPart& part,
                             const Progress& progress) {
  ViewPhotographs view;
  view.radiance.resize(frames.size());
  view.hasMatte = part.matte;
  size_t done = 0;
  developAll(
      capture, frames, progress,
      [&](size_t i, Photograph photograph) {
        view.radiance[i] = std::move(photograph.radiance);
        view.invalidTexels += photograph.invalidTexels.size();
        if (i == 0) view.alpha = std::move(photograph.alpha);
        progress("reading", static_cast<double>(++done) / static_cast<double>(frames.size()));
      },
      part);
  return view;
}

ViewPhotographs readViewPhotographs(const Capture& capture, std::span<const size_t> frames,
                                    const Progress& progress) {
  ViewPhotographs view;
  view.radiance.resize(frames.size());
  MatteVote vote(frames.size());
  std::vector<std::vector<bool>> clear(frames.size()); // texels without colour, of photographs with a matte
  std::vector<size_t> invalid(frames.size());
  image::Image opaque;
  developAll(capture, frames, progress, [&](size_t i, Photograph photograph) {
    view.radiance[i] = std::move(photograph.radiance);
    view.hasMatte |= photograph.hasMatte;
    invalid[i] = photograph.invalidTexels.size();
    if (photograph.hasMatte) {
      vote.add(photograph.alpha);
      clear[i].resize(photograph.alpha.values.size());
      std::transform(photograph.alpha.values.begin(), photograph.alpha.values.end(), clear[i].begin(),
                     [](float a) { return a == 0; });
    } else if (opaque.values.empty()) {
      opaque = std::move(photograph.alpha);
    }
  });
  view.alpha = view.hasMatte ? vote.outcome() : std::move(opaque);

  const std::vector<size_t> lacking = lackingColors(clear, view.alpha);
  std::vector<size_t> again;
  for (const size_t i : lacking) again.push_back(frames[i]);
  developAll(capture, again, progress,
             [&](size_t k, Photograph photograph) {
               view.radiance[lacking[k]] = std::move(photograph.radiance);
               invalid[lacking[k]] = photograph.invalidTexels.size();
             },
             {.matte = &view.alpha});
  view.invalidTexels = std::accumulate(invalid.begin(), invalid.end(), size_t{0});
  return view;
}

} // namespace surflect::capture
