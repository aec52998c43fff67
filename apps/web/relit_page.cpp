#include "apps/web/relit_page.h"

#include "srf/image/color.h"
#include "srf/planes/basis.h"
#include "srf/planes/light_interpolation.h"
#include "srf/planes/normals.h"
#include "srf/planes/plane_coder.h"
#include "srf/planes/ptm.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <mutex>

namespace surflect::web {

namespace {

namespace fs = std::filesystem;
using planes::Planes;

constexpr size_t kSampleNumbers = size_t{1} << 25; // floats of all samples together
constexpr size_t kMostSamples = 100'000;
constexpr size_t kLightsLeftOut = 12;
constexpr double kBelowWhite = 0.999, kBelowEvaluatedWhite = 0.995;
constexpr size_t kMostNormalPixels = 7'000'000; // a quarter of 24 megapixels fits; finer levels repeat theirs

// Errors of decoded samples under their own lights. Tiles add them in any order, so sums are of whole tiles,
// in the order of tiles.
struct SampledErrors {
  double linear = 0, srgb = 0;
  size_t count = 0;
};

// Levels of a picture: halves until one tile holds it.
int levelsOf(int width, int height) {
  int levels = 1;
  for (int side = std::max(width, height); side > kTile; side = (side + 1) / 2) ++levels;
  return levels;
}

// The planes of normals at twice the size, each pixel four times.
Planes doubled(const Planes& half, int width, int height) {
  Planes full{width, height, {}};
  for (const std::vector<float>& from : half.values) {
    std::vector<float>& to = full.values.emplace_back(full.pixels());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        to[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] =
            from[static_cast<size_t>(y / 2) * static_cast<size_t>(half.width) + static_cast<size_t>(x / 2)];
  }
  return full;
}

struct Tile {
  int x = 0, y = 0; // in tiles
  int width = 0, height = 0;
};

std::vector<Tile> tilesOf(int width, int height) {
  std::vector<Tile> tiles;
  for (int y = 0; y * kTile < height; ++y)
    for (int x = 0; x * kTile < width; ++x)
      tiles.push_back({x, y, std::min(kTile, width - x * kTile), std::min(kTile, height - y * kTile)});
  return tiles;
}

// Sums of what the decoded planes of a tile show at samples, against the photographs.
class CapturedErrors {
public:
  CapturedErrors(const planes::Stack& stack, const planes::Samples& samples, const planes::Basis& basis,
                 float white, float evaluatedWhite)
      : samples_(samples), basis_(basis), white_(white), evaluatedWhite_(evaluatedWhite),
        width_(stack.width()) {}

  // `grey` holds the decoded bytes of each plane.
  SampledErrors of(const Tile& tile, const std::vector<std::vector<uint8_t>>& grey,
                   std::span<const planes::PlaneRange> ranges) const {
    SampledErrors errors;
    const auto width = static_cast<size_t>(width_);
    const auto begin = std::ranges::lower_bound(samples_.pixels, static_cast<size_t>(tile.y) * kTile * width);
    const auto end =
        std::ranges::lower_bound(samples_.pixels, static_cast<size_t>(tile.y * kTile + tile.height) * width);
    Eigen::VectorXf coefficients(basis_.planes());
    for (auto at = begin; at != end; ++at) {
      const auto i = static_cast<size_t>(at - samples_.pixels.begin());
      const int x = static_cast<int>(*at % width) - tile.x * kTile,
                y = static_cast<int>(*at / width) - tile.y * kTile;
      if (samples_.inside[i] == 0 || x < 0 || x >= tile.width) continue;
      const auto in = static_cast<size_t>(y) * static_cast<size_t>(tile.width) + static_cast<size_t>(x);
      for (Eigen::Index k = 0; k < basis_.planes(); ++k)
        coefficients[k] = planes::valueOf(ranges[static_cast<size_t>(k)], grey[static_cast<size_t>(k)][in]);
      const Eigen::VectorXf shown = basis_.mean + basis_.vectors * coefficients;
      for (Eigen::Index row = 0; row < shown.size(); ++row) {
        const float got = std::clamp(planes::decoded(shown[row]) * white_ / evaluatedWhite_, 0.f, 1.f);
        const float wanted =
            std::clamp(samples_.linear(row, static_cast<Eigen::Index>(i)) / evaluatedWhite_, 0.f, 1.f);
        const auto linear = static_cast<double>(got - wanted);
        const auto srgb = static_cast<double>(image::srgbFromLinear(got) - image::srgbFromLinear(wanted));
        errors.linear += linear * linear;
        errors.srgb += srgb * srgb;
        ++errors.count;
      }
    }
    return errors;
  }

private:
  const planes::Samples& samples_;
  const planes::Basis& basis_;
  float white_, evaluatedWhite_;
  int width_;
};

Json rounded(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    Json& row = rows.emplace_back(Json::array());
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(static_cast<float>(matrix(r, c)));
  }
  return rows;
}

// Description of the planes and lights for the page.
Json dataOf(const planes::Stack& stack, const planes::Basis& basis,
            std::span<const planes::PlaneRange> ranges, const PageMark& mark, const PageReport& report,
            const PageOptions& options) {
  const planes::LightInterpolation interpolation(stack.towardsLights);
  // Row f, column (plane, channel): what feature f of the light adds to the weight of a plane; plane 0 is the
  // mean.
  const auto lights = static_cast<Eigen::Index>(stack.size());
  Eigen::MatrixXd table(lights, 3 * (basis.planes() + 1));
  for (Eigen::Index l = 0; l < lights; ++l)
    for (Eigen::Index c = 0; c < 3; ++c) {
      table(l, c) = static_cast<double>(basis.mean[3 * l + c]);
      for (Eigen::Index k = 0; k < basis.planes(); ++k)
        table(l, 3 * (k + 1) + c) = static_cast<double>(basis.vectors(3 * l + c, k));
    }
  Json data = {{"width", stack.width()}, {"height", stack.height()}, {"tile", kTile}};
  data["levels"] = report.levels;
  data["planes"] = report.planes;
  data["normals"] = report.hasNormals;
  data["toe"] = planes::kToe;
  data["white"] = report.white;
  Json& limits = data["ranges"] = Json::array();
  for (const planes::PlaneRange& range : ranges) limits.push_back({range.least, range.most});
  Json& captured = data["lights"] = Json::array();
  for (size_t l = 0; l < stack.size(); ++l) {
    const Vec3<double>& towards = stack.towardsLights[l];
    captured.push_back({{"name", stack.lights[l]}, {"towards", {towards.x(), towards.y(), towards.z()}}});
  }
  data["functions"] = rounded(interpolation.weightsFromFeatures().transpose() * table);
  data["object"] = mark.object;
  data["readOnly"] = options.readOnly;
  if (mark.scale) data["pixelsPerMm"] = *mark.scale;
  return data;
}

// Hash of what was captured, whatever the page's title, scale and planes: photographs and their lights.
uint64_t objectHash(const planes::Stack& stack, const planes::Samples& samples) {
  std::string all = fmt::format("{} {}", stack.width(), stack.height());
  for (const std::string& light : stack.lights) all += '\n' + light;
  all.append(reinterpret_cast<const char*>(samples.linear.data()),
             static_cast<size_t>(samples.linear.size()) * sizeof(float));
  return contentHash(all);
}

} // namespace

PageReport writeRelitPage(const planes::Stack& stack, const fs::path& folder, const PageOptions& options,
                          const CompleteMark& complete, const Progress& progress) {
  PageReport report;
  const size_t rows = 3 * stack.size();
  const planes::Samples samples =
      planes::sample(stack, std::min(kMostSamples, kSampleNumbers / rows), progress);
  const PageMark mark = complete(hex(objectHash(stack, samples)));
  const float white = planes::whiteOf(samples, kBelowWhite),
              evaluatedWhite = planes::whiteOf(samples, kBelowEvaluatedWhite);
  report.white = white;
  report.leftOut =
      planes::leaveLightsOut(stack, samples, evaluatedWhite, options.planes, kLightsLeftOut, progress);
  const planes::Basis basis =
      planes::principalBasis(planes::momentsOf(planes::encodedSamples(samples, white)), options.planes);
  report.planes = static_cast<int>(basis.planes());
  report.levels = levelsOf(stack.width(), stack.height());
  report.hasNormals = planes::tellNormals(stack.towardsLights);

  std::vector<Planes> levels{planes::projected(stack, basis, white, progress)};
  while (static_cast<int>(levels.size()) < report.levels) levels.push_back(planes::halved(levels.back()));
  std::vector<planes::PlaneRange> ranges;
  for (const std::vector<float>& plane : levels.front().values) ranges.push_back(planes::rangeOf(plane));
  planes::shareSteps(ranges, options.quality);
  if (report.hasNormals) {
    size_t first = 0;
    while (levels[first].pixels() > kMostNormalPixels) ++first;
    std::vector<Planes> normals(levels.size());
    normals[first] = planes::normalsOf(levels[first], basis, stack.towardsLights, progress);
    for (size_t n = first + 1; n < levels.size(); ++n) normals[n] = planes::halved(normals[n - 1]);
    for (size_t n = first; n-- > 0;) normals[n] = doubled(normals[n + 1], levels[n].width, levels[n].height);
    for (size_t n = 0; n < levels.size(); ++n)
      for (std::vector<float>& plane : normals[n].values) levels[n].values.push_back(std::move(plane));
    ranges.insert(ranges.end(), 2, {-1, 1, options.quality});
  }

  const CapturedErrors captured(stack, samples, basis, white, evaluatedWhite);
  SampledErrors sum;
  double done = 0, all = 0;
  for (const Planes& level : levels) all += static_cast<double>(level.pixels());
  for (size_t n = 0; n < levels.size(); ++n) {
    const Planes& level = levels[n];
    const fs::path place = folder / "tiles" / std::to_string(n);
    createFolder(place);
    const std::vector<Tile> tiles = tilesOf(level.width, level.height);
    std::vector<SampledErrors> errors(tiles.size());
    std::mutex reporting;
    tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t t) {
      const Tile& tile = tiles[t];
      const auto count = static_cast<size_t>(tile.width) * static_cast<size_t>(tile.height);
      std::string list;
      std::vector<std::vector<uint8_t>> decoded;
      std::vector<uint8_t> grey(count);
      for (size_t k = 0; k < level.values.size(); ++k) {
        for (int y = 0; y < tile.height; ++y)
          for (int x = 0; x < tile.width; ++x)
            grey[static_cast<size_t>(y) * static_cast<size_t>(tile.width) + static_cast<size_t>(x)] =
                planes::byteOf(ranges[k], level.values[k][static_cast<size_t>(tile.y * kTile + y) *
                                                              static_cast<size_t>(level.width) +
                                                          static_cast<size_t>(tile.x * kTile + x)]);
        const std::string jpeg = planes::greyJpeg(grey, tile.width, tile.height, ranges[k].quality);
        list += (k > 0 ? ",\"" : "\"") + base64(jpeg) + '"';
        if (n == 0 && k < static_cast<size_t>(report.planes))
          decoded.push_back(planes::greyOf(jpeg, tile.width, tile.height));
      }
      const std::string name = fmt::format("{}_{}", tile.x, tile.y);
      writeText(place / (name + ".js"), fmt::format("surflect.tile(\"{}/{}\",[{}]);\n", n, name, list));
      if (n == 0) errors[t] = captured.of(tile, decoded, ranges);
      const std::lock_guard lock(reporting);
      done += static_cast<double>(count);
      progress("tiles", done / all);
    });
    for (const SampledErrors& of : errors)
      sum.linear += of.linear, sum.srgb += of.srgb, sum.count += of.count;
    report.tiles += static_cast<int>(tiles.size());
  }
  const auto count = static_cast<double>(std::max<size_t>(sum.count, 1));
  report.captured = {sum.linear / count, sum.srgb / count};

  levels.clear();
  levels.shrink_to_fit(); // a PTM takes as much
  if (options.ptm) writeText(folder / kPtmFile, planes::lrgbPtm(stack, white, progress));
  writePage("relit.html", mark, folder);
  writeScript(folder / "data.js", "data", dataOf(stack, basis, ranges, mark, report, options));
  return report;
}

} // namespace surflect::web
