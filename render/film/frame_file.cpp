#include "render/film/frame_file.h"

#include "srf/image/exr.h"
#include "srf/image/image.h"
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

double whiteOf(const image::Image& color) {
  image::PercentileCounter values;
  for (size_t i = 0; i < color.values.size(); i += 4)
    if (color.values[i + 3] > 0.5f)
      std::for_each_n(&color.values[i], 3, [&](float value) { values.add(value); });
  return values.percentile(0.995);
}

} // namespace surflect::film
