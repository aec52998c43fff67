#include "render/film/frame_file.h"

#include "srf/image/exr.h"
#include "srf/image/image.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <utility>

namespace surflect::film {

namespace {

bool isPlace(const std::string& layer) { return layer == "position" || layer == "rest"; }

image::ChannelSet channelNames(const std::string& layer, int channels) {
  if (layer == "depth") return {"depth.Z"};
  if (layer == "normal" || isPlace(layer)) return {layer + ".X", layer + ".Y", layer + ".Z"};
  if (channels == 1) return {layer + ".V"};
  return {layer + ".R", layer + ".G", layer + ".B"};
}

constexpr const char* kShadow = "shadow";

} // namespace

image::Image overShadow(const method::FrameLayers& film) {
  image::Image color = film.color;
  for (size_t i = 0; i < film.shadow.values.size(); ++i) color.values[4 * i + 3] += film.shadow.values[i];
  return color;
}

std::string frameBytes(const method::FrameLayers& film, const image::ExrAttributes& attributes,
                       const Progress& progress) {
  const bool hasShadow = !film.shadow.values.empty();
  const image::Image sum = hasShadow ? overShadow(film) : image::Image();
  std::vector<image::ExrLayer> layers{
      {{"R", "G", "B", "A"}, hasShadow ? &sum : &film.color, image::Precision::half, nullptr, 0}};
  if (hasShadow) layers.push_back({channelNames(kShadow, 1), &film.shadow});
  for (const auto& [name, image] : film.aovs)
    layers.push_back({channelNames(name, image.channels), &image,
                      name == "depth" || isPlace(name) ? image::Precision::single : image::Precision::half});
  return image::exrBytes(layers, attributes, progress);
}

void writeFrame(const std::filesystem::path& path, const method::FrameLayers& film,
                const image::ExrAttributes& attributes) {
  writeFileAtomically(path, frameBytes(film, attributes));
}

method::FrameLayers readFrame(const std::filesystem::path& path) {
  const image::ExrFile file(path);
  std::vector<image::ChannelSet> sets{{"R", "G", "B", "A"}};
  const image::ChannelSet shadow = channelNames(kShadow, 1);
  if (file.has(shadow[0])) sets.push_back(shadow);
  std::vector<image::Image> images = file.read(sets);
  method::FrameLayers film{std::move(images[0]), {}};
  if (images.size() == 1) return film;
  film.shadow = std::move(images[1]);
  for (size_t i = 0; i < film.shadow.values.size(); ++i) {
    float& alpha = film.color.values[4 * i + 3];
    alpha = std::max(0.f, alpha - film.shadow.values[i]); // below 0 by the rounding of both
  }
  return film;
}

double whiteOf(const image::Image& color) {
  image::PercentileCounter values;
  for (size_t i = 0; i < color.values.size(); i += 4)
    if (color.values[i + 3] > 0.5f)
      std::for_each_n(&color.values[i], 3, [&](float value) { values.add(value); });
  return values.percentile(0.995);
}

} // namespace surflect::film
