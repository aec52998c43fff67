#include "render/film.h"

#include "render/measure.h"
#include "srf/image/exr.h"
#include "srf/image/percentile.h"
#include "srf/image/png.h"

#include <algorithm>

namespace surflect {

namespace {

ChannelSet channelNames(const std::string& layer, int channels) {
  if (layer == "depth") return {"depth.Z"};
  if (layer == "normal") return {"normal.X", "normal.Y", "normal.Z"};
  if (channels == 1) return {layer + ".V"};
  return {layer + ".R", layer + ".G", layer + ".B"};
}

} // namespace

void writeFilm(const std::filesystem::path& path, const Film& film,
               const std::map<std::string, std::string>& attributes) {
  Image color = film.color;
  for (float& value : color.values) value = std::max(value, 0.f);
  std::vector<ExrLayer> layers{{{"R", "G", "B", "A"}, &color, Precision::half}};
  for (const auto& [name, image] : film.aovs)
    layers.push_back(
        {channelNames(name, image.channels), &image, name == "depth" ? Precision::single : Precision::half});
  writeExr(path, layers, attributes);
}

void writePreview(const std::filesystem::path& path, const Image& color, double exposure) {
  Image straight = color;
  for (size_t i = 0; i < straight.values.size(); i += 4)
    if (const float alpha = straight.values[i + 3]; alpha > 0)
      for (size_t c = 0; c < 3; ++c) straight.values[i + c] *= static_cast<float>(exposure) / alpha;
  Image encoded = srgbEncoded(exposed(straight, 1));
  for (size_t i = 3; i < encoded.values.size(); i += 4) encoded.values[i] = color.values[i];
  writePng(path, encoded, 8, PngColors::srgb);
}

double whiteOf(const Image& color) {
  PercentileCounter values;
  for (size_t i = 0; i < color.values.size(); i += 4)
    if (color.values[i + 3] > 0.5f)
      std::for_each_n(&color.values[i], 3, [&](float value) { values.add(value); });
  return values.percentile(0.995);
}

} // namespace surflect
