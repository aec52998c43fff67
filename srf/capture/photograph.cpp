#include "srf/capture/photograph.h"

#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "surfel/error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

namespace surflect {

namespace {

// Pixels as the file has them.
struct Undeveloped {
  Image color; // 1 or 3 channels
  std::optional<Image> alpha;
  int bits = 0; // as in Picture
  bool alphaPremultiplied = false;
};

Image channelsOf(const Image& image, int first, int count) {
  Image part(image.width, image.height, count);
  const size_t pixels = part.values.size() / static_cast<size_t>(count);
  for (size_t i = 0; i < pixels; ++i)
    std::copy_n(image.values.begin() + static_cast<std::ptrdiff_t>(i) * image.channels + first, count,
                part.values.begin() + static_cast<std::ptrdiff_t>(i) * count);
  return part;
}

Undeveloped split(const Picture& picture) {
  const int channels = picture.image.channels, colors = picture.hasAlpha() ? channels - 1 : channels;
  Undeveloped parts{channelsOf(picture.image, 0, colors), {}, picture.bits, picture.alphaPremultiplied};
  if (picture.hasAlpha()) parts.alpha = channelsOf(picture.image, colors, 1);
  return parts;
}

// The layers of one EXR, in one pass over it.
std::vector<Undeveloped> readLayers(const std::filesystem::path& path,
                                    const std::vector<const Frame*>& frames) {
  const ExrFile file(path);
  std::vector<ChannelSet> sets; // colour, and where there is one alpha, per frame
  std::vector<bool> hasAlpha;
  for (const Frame* frame : frames) {
    sets.push_back(colorChannels(file, frame->layer));
    const auto alpha = alphaChannel(file, frame->alphaLayer.empty() ? frame->layer : frame->alphaLayer);
    if (!alpha && !frame->alphaLayer.empty())
      throw Error::mismatch("a channel A", "none").at("layer " + frame->alphaLayer).in(path);
    hasAlpha.push_back(alpha.has_value());
    if (alpha) sets.push_back({*alpha});
  }
  std::vector<Image> images = file.read(sets);
  std::vector<Undeveloped> layers;
  auto next = images.begin();
  for (const bool withAlpha : hasAlpha) {
    Undeveloped& layer = layers.emplace_back(Undeveloped{std::move(*next++), {}, 0, true});
    if (withAlpha) layer.alpha = std::move(*next++);
  }
  return layers;
}

// One picture for each of the frames that use the file.
std::vector<Undeveloped> readShared(const std::filesystem::path& path,
                                    const std::vector<const Frame*>& frames) {
  if (formatOf(path) == PictureFormat::exr) return readLayers(path, frames);
  for (const Frame* frame : frames)
    if (!frame->layer.empty() || !frame->alphaLayer.empty())
      throw Error("only .exr files have layers").at("layer " + frame->layer + frame->alphaLayer).in(path);
  return std::vector<Undeveloped>(frames.size(), split(readPicture(path)));
}

void checkSize(const Image& image, const Lens& lens, const std::filesystem::path& path) {
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  if (image.width != lens.width || image.height != lens.height)
    throw Error::mismatch(size(lens.width, lens.height), size(image.width, image.height)).at("size").in(path);
}

// How much of the pixel a mask keeps: white keeps all, black and transparent nothing.
Image coverageOf(const Picture& mask) {
  Image coverage(mask.image.width, mask.image.height, 1);
  const size_t channels = static_cast<size_t>(mask.image.channels);
  for (size_t i = 0; i < coverage.values.size(); ++i) {
    const float* texel = mask.image.values.data() + i * channels;
    const float white = channels >= 3 ? luma({texel[0], texel[1], texel[2]}) : texel[0];
    const float opaque = mask.hasAlpha() && !mask.alphaPremultiplied ? texel[channels - 1] : 1;
    coverage.values[i] = white * opaque;
  }
  return coverage;
}

float unit(float value) { return value > 0 ? std::min(value, 1.f) : 0; } // NaN is 0

bool storesSrgb(const std::optional<ColorSpace>& stated, int bits) {
  return stated ? *stated == ColorSpace::srgb : bits == 8;
}

Photograph develop(const Undeveloped& picture, const Image* coverage, bool srgb, double exposure) {
  const int width = picture.color.width, height = picture.color.height;
  Photograph photograph{Image(width, height, 3), Image(width, height, 1)};
  photograph.hasMatte = picture.alpha || coverage;
  const size_t colors = static_cast<size_t>(picture.color.channels);
  const float perSecond = static_cast<float>(1 / exposure);

  for (size_t i = 0; i < photograph.alpha.values.size(); ++i) {
    const float pictureAlpha = picture.alpha ? picture.alpha->values[i] : 1;
    const float alpha = unit(pictureAlpha) * (coverage ? unit(coverage->values[i]) : 1);
    photograph.alpha.values[i] = alpha;
    bool valid = std::isfinite(pictureAlpha);
    float* radiance = photograph.radiance.values.data() + 3 * i;
    for (size_t c = 0; c < 3 && alpha > 0; ++c) {
      const float stored = picture.color.values[i * colors + (colors == 3 ? c : 0)];
      const float straight = picture.alphaPremultiplied ? stored / pictureAlpha : stored;
      radiance[c] = (srgb ? linearFromSrgb(straight) : straight) * perSecond;
      valid = valid && std::isfinite(radiance[c]);
    }
    if (valid) continue;
    std::fill_n(radiance, 3, 0.f);
    ++photograph.invalidTexels;
  }
  return photograph;
}

} // namespace

std::vector<Photograph> readPhotographs(const Capture& capture, std::span<const size_t> frames) {
  std::map<std::filesystem::path, std::vector<size_t>> users; // positions in `frames`
  for (size_t i = 0; i < frames.size(); ++i) {
    assert(frames[i] < capture.frames.size());
    users[capture.frames[frames[i]].picture].push_back(i);
  }
  std::map<std::filesystem::path, Image> masks;
  std::vector<Photograph> photographs(frames.size());
  for (const auto& [name, positions] : users) {
    std::vector<const Frame*> sharing;
    for (const size_t i : positions) sharing.push_back(&capture.frames[frames[i]]);
    const std::filesystem::path path = capture.folder() / name;
    std::vector<Undeveloped> pictures = readShared(path, sharing);
    for (size_t k = 0; k < sharing.size(); ++k) {
      const Frame& frame = *sharing[k];
      const Lens& lens = capture.views[frame.view].camera.lens;
      checkSize(pictures[k].color, lens, path);
      const Image* coverage = nullptr;
      if (!frame.mask.empty()) {
        const auto [mask, isNew] = masks.try_emplace(frame.mask);
        if (isNew) mask->second = coverageOf(readPicture(capture.folder() / frame.mask));
        checkSize(mask->second, lens, capture.folder() / frame.mask);
        coverage = &mask->second;
      }
      photographs[positions[k]] =
          develop(pictures[k], coverage, storesSrgb(capture.colorSpace, pictures[k].bits), frame.exposure);
      pictures[k] = {}; // its memory is not needed any more
    }
  }
  return photographs;
}

} // namespace surflect
