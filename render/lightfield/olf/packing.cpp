#include "render/lightfield/olf/packing.h"

#include "render/lightfield/common/pull_push.h"
#include "render/lightfield/lfm/s3tc.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

namespace surflect::olf {

namespace {

int scaledSize(int size, double scale) {
  return std::max(1, static_cast<int>(std::ceil(scale * size - 1e-9)));
}

struct LayerSize {
  int width = 1, height = 1;
};

LayerSize layerSize(std::span<const image::PixelWindow> windows, double scale, bool s3tc) {
  LayerSize size;
  for (const image::PixelWindow& window : windows)
    size = {std::max(size.width, scaledSize(window.width(), scale)),
            std::max(size.height, scaledSize(window.height(), scale))};
  return s3tc ? LayerSize{lfm::wholeBlocks(size.width), lfm::wholeBlocks(size.height)} : size;
}

// Red, green and blue of a texel over its alpha, and alpha; black where it is transparent.
Eigen::Vector4f straight(const Texel& texel) {
  const float alpha = image::floatOfHalf(texel[3]);
  Eigen::Vector4f color(0, 0, 0, std::clamp(alpha, 0.f, 1.f));
  if (alpha > 0)
    for (Eigen::Index c = 0; c < 3; ++c)
      color[c] = std::max(0.f, image::floatOfHalf(texel[static_cast<size_t>(c)])) / alpha;
  return color;
}

// Views that are read at once, so that they and what is made of them take about a gigabyte; at least one.
size_t picturesAtOnce(const lightfield::Views& views, std::span<const size_t> training, bool s3tc) {
  constexpr size_t kMost = 8, kBytes = size_t{1} << 30;
  // Bytes of a pixel: the picture as floats, twice; half floats, roots, and the levels that fill them.
  const size_t ofPixel = 32 + (s3tc ? 50 : 8);
  size_t pixels = 1;
  for (const size_t view : training) {
    const capture::Lens& lens = views.camera(view).lens;
    pixels = std::max(pixels, static_cast<size_t>(lens.width) * static_cast<size_t>(lens.height));
  }
  return std::clamp<size_t>(kBytes / (ofPixel * pixels), 1, kMost);
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

double whiteLevel(std::span<const Texel> texels) {
  constexpr double kShare = 0.995;
  constexpr float kOpaque = 0.5f;
  image::PercentileCounter values;
  for (const Texel& texel : texels)
    if (const float alpha = image::floatOfHalf(texel[3]); alpha > kOpaque)
      values.add(std::max({image::floatOfHalf(texel[0]), image::floatOfHalf(texel[1]),
                           image::floatOfHalf(texel[2])}) /
                 alpha);
  const double level = values.percentile(kShare);
  return level > 0 ? level : 1;
}

ViewBlocks viewBlocks(std::vector<Texel> texels, int width, int height) {
  constexpr float kVisible = 1.f / 8; // alpha of colours that count as the brightest
  constexpr float kBrightest = 4;     // of white levels; brighter colours are cut off
  const float most = kBrightest * static_cast<float>(whiteLevel(texels));
  ViewBlocks result;
  float brightest = 0;
  std::vector<Eigen::Vector4f> filled;
  std::vector<uint8_t> alphas;
  filled.reserve(texels.size()), alphas.reserve(texels.size());
  for (const Texel& texel : texels) {
    Eigen::Vector4f& color = filled.emplace_back(straight(texel));
    alphas.push_back(static_cast<uint8_t>(std::lround(255 * color[3])));
    if (color[3] >= kVisible) {
      const float value = color.head<3>().maxCoeff();
      brightest = std::max(brightest, value);
      ++result.visible, result.cutOff += value > most;
    }
    color[3] = color[3] > 0 ? 1.f : 0.f;
  }
  texels = {};
  result.white = brightest > 0 ? std::min(brightest, most) : 1;
  for (Eigen::Vector4f& color : filled)
    color.head<3>() = (color.head<3>() / result.white).cwiseMin(1.f).cwiseSqrt();
  lightfield::pullPush(filled, width, height);
  std::vector<uint8_t> bytes(4 * filled.size());
  for (size_t i = 0; i < filled.size(); ++i) {
    for (size_t c = 0; c < 3; ++c)
      bytes[4 * i + c] = static_cast<uint8_t>(std::lround(255 * filled[i][static_cast<Eigen::Index>(c)]));
    bytes[4 * i + 3] = alphas[i];
  }
  filled = {};
  result.blocks = lfm::s3tcBlocks(bytes, static_cast<size_t>(width), static_cast<size_t>(height),
                                  lfm::Blocks::dxt5, lfm::ColorFit::byAlpha);
  return result;
}

PackedViews packViews(const lightfield::Views& views, std::span<const size_t> training,
                      const PackingOptions& options, PackingReport& report, const Progress& progress) {
  const size_t budget = options.budget;
  const Progress quiet{{}, progress.cancelled};
  const auto eachPicture = [&](const char* step, const auto& use) {
    const size_t atOnce = picturesAtOnce(views, training, options.s3tc);
    for (size_t begin = 0; begin < training.size(); begin += atOnce) {
      progress(step, static_cast<double>(begin) / static_cast<double>(training.size()));
      tbb::parallel_for(begin, std::min(training.size(), begin + atOnce), [&](size_t i) {
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
  const size_t least = (options.s3tc ? blockBytes(lfm::Blocks::dxt5) : sizeof(Texel)) * training.size();
  if (budget < least)
    throw Error::mismatch(fmt::format("{} bytes or more for {} views", least, training.size()),
                          std::to_string(budget))
        .at("budget");
  const auto bytesAt = [&](double scale) {
    const auto [width, height] = layerSize(windows, scale, options.s3tc);
    return static_cast<double>(options.s3tc ? 1 : sizeof(Texel)) * static_cast<double>(training.size()) *
           width * height;
  };
  double scale = 1;
  while (bytesAt(scale) > static_cast<double>(budget))
    scale *= std::min(0.99, std::sqrt(static_cast<double>(budget) / bytesAt(scale)));
  report.scale = scale;

  PackedViews packed;
  const auto [width, height] = layerSize(windows, scale, options.s3tc);
  packed.width = width, packed.height = height;
  packed.views.resize(training.size());
  const size_t size = packed.layerTexels();
  if (options.s3tc)
    packed.blocks.resize(training.size() * size);
  else
    packed.texels.resize(training.size() * size);
  std::atomic<size_t> visible = 0, cutOff = 0;
  eachPicture("pack", [&](size_t i, const image::Image& picture) {
    const image::PixelWindow& window = windows[i];
    PackedView& view = packed.views[i];
    view.width = scaledSize(window.width(), scale), view.height = scaledSize(window.height(), scale);
    view.low = {window.x0, window.y0};
    view.scale = {static_cast<double>(view.width) / window.width(),
                  static_cast<double>(view.height) / window.height()};
    const image::Image part = image::resampled(picture, window, view.width, view.height);
    std::vector<Texel> own(options.s3tc ? size : 0, Texel{});
    const std::span<Texel> layer = options.s3tc ? own : std::span(packed.texels).subspan(i * size, size);
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        Texel& texel =
            layer[static_cast<size_t>(y) * static_cast<size_t>(packed.width) + static_cast<size_t>(x)];
        for (size_t c = 0; c < 4; ++c) texel[c] = image::finiteHalf(part.at(x, y)[c]);
      }
    if (!options.s3tc) return;
    const ViewBlocks blocks = viewBlocks(std::move(own), packed.width, packed.height);
    view.white = blocks.white;
    visible += blocks.visible, cutOff += blocks.cutOff;
    std::ranges::copy(blocks.blocks, packed.blocks.begin() + static_cast<std::ptrdiff_t>(i * size));
  });
  report.cutOffShare = visible > 0 ? static_cast<double>(cutOff) / static_cast<double>(visible) : 0;
  return packed;
}

} // namespace surflect::olf
