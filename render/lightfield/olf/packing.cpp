#include "render/lightfield/olf/packing.h"

#include "srf/image/half_float.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect::olf {

namespace {

int scaledSize(int size, double scale) {
  return std::max(1, static_cast<int>(std::ceil(scale * size - 1e-9)));
}

struct LayerSize {
  int width = 1, height = 1;
};

LayerSize layerSize(std::span<const image::PixelWindow> windows, double scale) {
  LayerSize size;
  for (const image::PixelWindow& window : windows)
    size = {std::max(size.width, scaledSize(window.width(), scale)),
            std::max(size.height, scaledSize(window.height(), scale))};
  return size;
}

} // namespace

image::PixelWindow objectWindow(const image::Image& rgba) {
  image::PixelWindow window{rgba.width, rgba.height, 0, 0};
  for (int y = 0; y < rgba.height; ++y)
    for (int x = 0; x < rgba.width; ++x)
      if (rgba.at(x, y)[3] > 0)
        window = {std::min(window.x0, std::max(0, x - 1)), std::min(window.y0, std::max(0, y - 1)),
                  std::max(window.x1, std::min(rgba.width, x + 2)),
                  std::max(window.y1, std::min(rgba.height, y + 2))};
  return window.width() > 0 ? window : image::PixelWindow{0, 0, 1, 1};
}

void mendInvalid(image::Image& rgba) {
  const image::Image before = rgba;
  const auto isValid = [](std::span<const float> pixel) {
    return std::ranges::all_of(pixel, [](float value) { return std::isfinite(value); });
  };
  for (int y = 0; y < rgba.height; ++y)
    for (int x = 0; x < rgba.width; ++x) {
      if (isValid(before.at(x, y))) continue;
      std::array<float, 4> sum{};
      float count = 0;
      for (int j = std::max(0, y - 1); j <= std::min(rgba.height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(rgba.width - 1, x + 1); ++i)
          if (const auto pixel = before.at(i, j); isValid(pixel)) {
            for (size_t c = 0; c < 4; ++c) sum[c] += pixel[c];
            ++count;
          }
      for (size_t c = 0; c < 4; ++c) rgba.at(x, y)[c] = count > 0 ? sum[c] / count : 0;
    }
}

PackedViews packViews(const lightfield::Views& views, std::span<const size_t> training, size_t budget,
                      PackingReport& report, const Progress& progress) {
  constexpr size_t kPicturesAtOnce = 8;
  const Progress quiet{{}, progress.cancelled};
  const auto eachPicture = [&](const char* step, const auto& use) {
    for (size_t begin = 0; begin < training.size(); begin += kPicturesAtOnce) {
      progress(step, static_cast<double>(begin) / static_cast<double>(training.size()));
      tbb::parallel_for(begin, std::min(training.size(), begin + kPicturesAtOnce), [&](size_t i) {
        image::Image picture = views.read(training[i], quiet);
        mendInvalid(picture);
        use(i, picture);
      });
    }
  };
  std::vector<image::PixelWindow> windows(training.size());
  eachPicture("object boxes",
              [&](size_t i, const image::Image& picture) { windows[i] = objectWindow(picture); });
  report.pictureBytes = 0;
  for (const size_t view : training) {
    const capture::Lens& lens = views.camera(view).lens;
    report.pictureBytes +=
        sizeof(Texel) * static_cast<uint64_t>(lens.width) * static_cast<uint64_t>(lens.height);
  }
  if (budget < sizeof(Texel) * training.size())
    throw Error::mismatch(
        fmt::format("{} bytes or more for {} views", sizeof(Texel) * training.size(), training.size()),
        std::to_string(budget))
        .at("budget");
  const auto bytesAt = [&](double scale) {
    const auto [width, height] = layerSize(windows, scale);
    return static_cast<double>(sizeof(Texel)) * static_cast<double>(training.size()) * width * height;
  };
  double scale = 1;
  while (bytesAt(scale) > static_cast<double>(budget))
    scale *= std::min(0.99, std::sqrt(static_cast<double>(budget) / bytesAt(scale)));
  report.scale = scale;

  PackedViews packed;
  const auto [width, height] = layerSize(windows, scale);
  packed.width = width, packed.height = height;
  packed.views.resize(training.size());
  const size_t size = static_cast<size_t>(width) * static_cast<size_t>(height);
  packed.texels.resize(training.size() * size);
  eachPicture("pack", [&](size_t i, const image::Image& picture) {
    const image::PixelWindow& window = windows[i];
    PackedView& view = packed.views[i];
    view.width = scaledSize(window.width(), scale), view.height = scaledSize(window.height(), scale);
    view.low = {window.x0, window.y0};
    view.scale = {static_cast<double>(view.width) / window.width(),
                  static_cast<double>(view.height) / window.height()};
    const image::Image part = image::resampled(picture, window, view.width, view.height);
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        Texel& texel = packed.texels[i * size + static_cast<size_t>(y) * static_cast<size_t>(width) +
                                     static_cast<size_t>(x)];
        for (size_t c = 0; c < 4; ++c) texel[c] = image::finiteHalf(part.at(x, y)[c]);
      }
  });
  return packed;
}

} // namespace surflect::olf
