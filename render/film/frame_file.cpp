#include "render/film/frame_file.h"

#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/image.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"

#include <algorithm>

namespace surflect::film {

namespace {

bool isPlace(const std::string& layer) { return layer == "position" || layer == "rest"; }

image::ChannelSet channelNames(const std::string& layer, int channels) {
  if (layer == "depth") return {"depth.Z"};
  if (layer == "normal" || isPlace(layer)) return {layer + ".X", layer + ".Y", layer + ".Z"};
  if (channels == 1) return {layer + ".V"};
  return {layer + ".R", layer + ".G", layer + ".B"};
}

} // namespace

std::string frameBytes(const method::FrameLayers& film, const image::ExrAttributes& attributes,
                       const Progress& progress) {
  std::vector<image::ExrLayer> layers{
      {{"R", "G", "B", "A"}, &film.color, image::Precision::half, nullptr, 0}};
  for (const auto& [name, image] : film.aovs)
    layers.push_back({channelNames(name, image.channels), &image,
                      name == "depth" || isPlace(name) ? image::Precision::single : image::Precision::half});
  return image::exrBytes(layers, attributes, progress);
}

void writeFrame(const std::filesystem::path& path, const method::FrameLayers& film,
                const image::ExrAttributes& attributes) {
  writeFileAtomically(path, frameBytes(film, attributes));
}

std::string previewBytes(const image::Image& color, double exposure) {
  static const image::SrgbBytes srgbBytes;
  image::PngSamples preview{color.width, color.height,           4,
                            8,           image::PngColors::srgb, std::vector<uint8_t>(color.values.size())};
  for (size_t i = 0; i < color.values.size(); i += 4) {
    const float* pixel = &color.values[i];
    if (pixel[0] == 0 && pixel[1] == 0 && pixel[2] == 0 && pixel[3] == 0) continue;
    const float alpha = pixel[3];
    const float scale = alpha > 0 ? static_cast<float>(exposure) / alpha : 1;
    for (size_t c = 0; c < 3; ++c) preview.bytes[i + c] = srgbBytes(pixel[c] * scale);
    preview.bytes[i + 3] = static_cast<uint8_t>(image::quantized(alpha, 255));
  }
  return image::pngBytes(preview);
}

void writePreview(const std::filesystem::path& path, const image::Image& color, double exposure) {
  writeFileAtomically(path, previewBytes(color, exposure));
}

double whiteOf(const image::Image& color) {
  image::PercentileCounter values;
  for (size_t i = 0; i < color.values.size(); i += 4)
    if (color.values[i + 3] > 0.5f)
      std::for_each_n(&color.values[i], 3, [&](float value) { values.add(value); });
  return values.percentile(0.995);
}

} // namespace surflect::film
