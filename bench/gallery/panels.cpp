#include "bench/gallery/figures.h"

#include "render/evaluation/label.h"
#include "render/film/frame_file.h"
#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>

namespace surflect::bench {

namespace {

using Json = nlohmann::json;

constexpr int kGap = 6, kLabelScale = 2, kHead = (evaluation::kLabelHeight + 4) * kLabelScale;

// Colour of a stretch: blue for circles, green at 1:2, red from 1:4 on [Weyrich 2005, Fig. 15].
Rgb stretchColor(float stretch) {
  const float t = std::clamp(std::log2(std::max(stretch, 1.f)), 0.f, 2.f);
  if (t < 1) return {0.05f, 0.1f + 0.75f * t, 0.9f * (1 - t) + 0.1f};
  return {0.05f + 0.9f * (t - 1), 0.85f * (2 - t) + 0.05f, 0.1f};
}

// Panel of a figure, in sRGB with straight alpha.
struct Panel {
  image::Image picture; // RGBA
  std::string label;
};

image::Image filmLayer(const std::filesystem::path& file, const std::string& layer, double white) {
  const image::ExrFile exr(file);
  image::Image color = exr.read({"R", "G", "B", "A"});
  const bool isColor = layer == "color";
  const image::Image values = isColor ? image::Image()
                              : layer == "stretch" || layer == "predicted_error"
                                  ? exr.read({layer + ".V"})
                                  : exr.read({layer + ".R", layer + ".G", layer + ".B"});
  for (size_t i = 0; i < color.values.size() / 4; ++i) {
    float* pixel = &color.values[4 * i];
    const float alpha = pixel[3];
    if (!(alpha > 0)) continue;
    const auto encode = [&](float value) {
      return image::srgbFromLinear(std::clamp(value / alpha / static_cast<float>(white), 0.f, 1.f));
    };
    Rgb c;
    if (isColor) {
      c = {encode(pixel[0]), encode(pixel[1]), encode(pixel[2])};
    } else if (layer == "predicted_error") {
      c.r = c.g = c.b = encode(values.values[i]);
    } else if (layer == "stretch") {
      c = stretchColor(values.values[i] / alpha);
    } else {
      const float* v = &values.values[3 * i];
      c = {v[0] / alpha, v[1] / alpha, v[2] / alpha};
    }
    pixel[0] = c.r, pixel[1] = c.g, pixel[2] = c.b;
  }
  return color;
}

image::Image cellPicture(const std::filesystem::path& file, const std::string& layer, double white) {
  if (file.extension() == ".exr") return filmLayer(file, layer, white);
  const image::Image png = image::readPng(file).image;
  image::Image rgba(png.width, png.height, 4);
  for (int y = 0; y < png.height; ++y)
    for (int x = 0; x < png.width; ++x) {
      const auto from = png.at(x, y);
      const size_t colors = png.channels < 3 ? 1 : 3;
      for (size_t c = 0; c < 3; ++c) rgba.at(x, y)[c] = from[colors == 1 ? 0 : c];
      rgba.at(x, y)[3] = colors < from.size() ? from[colors] : 1.f;
    }
  return rgba;
}

// A lamp at a depth of the film: a disc with a soft edge, brightest at its centre.
struct Dot {
  double x, y, radius;
  Rgb color;
  double depth;
};

Dot dotOf(const std::array<double, 7>& numbers) {
  const auto [x, y, radius, r, g, b, depth] = numbers;
  return {x, y, radius, {static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)}, depth};
}

void drawDot(image::Image& image, const image::Image& depth, const Dot& dot) {
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) {
      if (depth.at(i, j)[0] < dot.depth) continue;
      const double distance = std::hypot(i + 0.5 - dot.x, j + 0.5 - dot.y);
      const auto share = static_cast<float>(std::clamp(dot.radius + 0.5 - distance, 0., 1.));
      const auto core = static_cast<float>(std::clamp(1 - distance / dot.radius, 0., 1.));
      const auto pixel = image.at(i, j);
      const std::array lamp{dot.color.r, dot.color.g, dot.color.b};
      for (size_t c = 0; c < 3; ++c) pixel[c] += share * (lamp[c] + (1 - lamp[c]) * core * core - pixel[c]);
      pixel[3] += share * (1 - pixel[3]);
    }
}

// The box [x, y, width, height], with each pixel enlarged to zoom x zoom.
image::Image enlarged(const image::Image& image, const std::array<int, 4>& box, int zoom) {
  const auto [x0, y0, width, height] = box;
  if (x0 < 0 || y0 < 0 || width < 1 || height < 1 || x0 + width > image.width || y0 + height > image.height)
    throw Error("crop: beyond the picture");
  return image::resampled(image, {x0, y0, x0 + width, y0 + height}, zoom * width, zoom * height);
}

} // namespace

void composePanels(std::istream& input) {
  const Json layout = Json::parse(input);
  std::map<std::string, double> whites;
  const auto nameOfWhite = [](const Json& cell) { return cell.value("white", ""); };
  const auto isColor = [](const Json& cell) {
    return std::filesystem::path(cell.at("file").get<std::string>()).extension() == ".exr" &&
           cell.value("layer", "color") == "color";
  };
  for (const Json& cell : layout.at("cells"))
    if (isColor(cell)) {
      double& white = whites[nameOfWhite(cell)];
      white = std::max(white, film::whiteOf(film::readFrame(cell.at("file").get<std::string>()).color));
    }

  std::vector<Panel> panels;
  for (const Json& cell : layout.at("cells")) {
    const bool isRadiance = isColor(cell) || cell.value("layer", "") == "predicted_error";
    const double white = isRadiance ? whites[nameOfWhite(cell)] : 1;
    image::Image picture =
        cellPicture(cell.at("file").get<std::string>(), cell.value("layer", "color"), white);
    if (cell.contains("dots")) {
      const image::Image depth = image::ExrFile(cell.at("file").get<std::string>()).read({"depth.Z"});
      for (const auto& dot : cell.at("dots").get<std::vector<std::array<double, 7>>>())
        drawDot(picture, depth, dotOf(dot));
    }
    const auto crop = cell.value("crop", std::array{0, 0, picture.width, picture.height});
    panels.push_back({enlarged(picture, crop, cell.value("zoom", 1)), cell.value("label", "")});
  }

  // Each row is as high, and each column as wide, as its largest cell.
  const auto columns = layout.at("columns").get<size_t>();
  const size_t rows = (panels.size() + columns - 1) / columns;
  std::vector<int> lefts(columns + 1), tops(rows + 1);
  for (size_t column = 0; column < columns; ++column) {
    int width = 0;
    for (size_t i = column; i < panels.size(); i += columns) width = std::max(width, panels[i].picture.width);
    lefts[column + 1] = lefts[column] + width + kGap;
  }
  for (size_t row = 0; row < rows; ++row) {
    int height = 0;
    for (size_t i = row * columns; i < std::min(panels.size(), (row + 1) * columns); ++i)
      height = std::max(height, panels[i].picture.height + (panels[i].label.empty() ? 0 : kHead));
    tops[row + 1] = tops[row] + height + kGap;
  }

  const auto background = layout.value("background", std::array<float, 3>{1, 1, 1});
  image::Image sheet(lefts.back() - kGap, tops.back() - kGap, 3);
  std::ranges::fill(sheet.values, 1.f);
  for (size_t i = 0; i < panels.size(); ++i) {
    const auto& [picture, label] = panels[i];
    const int left = lefts[i % columns];
    int top = tops[i / columns];
    if (!label.empty()) {
      evaluation::drawLabel(sheet, left, top + kLabelScale, label, {0, 0, 0}, kLabelScale);
      top += kHead;
    }
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        const auto from = picture.at(x, y);
        for (size_t c = 0; c < 3; ++c)
          sheet.at(left + x, top + y)[c] = from[3] * from[c] + (1 - from[3]) * background[c];
      }
  }
  image::writePng(layout.at("out").get<std::string>(), sheet);
}

} // namespace surflect::bench
