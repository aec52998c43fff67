#include "srf/weights/environment_map.h"

#include "srf/image/image_file.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <queue>

namespace surflect::weights {

namespace {

constexpr double kPi = std::numbers::pi;

// Exact solid angle of a lat-long texel in row y: the area between its parallels and meridians.
double latLongSolidAngle(int y, int width, int height) {
  const double top = std::cos(kPi * y / height), bottom = std::cos(kPi * (y + 1) / height);
  return 2 * kPi / width * (top - bottom);
}

// Solid angle per image area of an angular map, up to a constant factor: sin(theta) / theta. From d omega =
// sin(theta) d theta d phi with theta = pi r, and du dv = r dr dphi / 4.
double angularDensity(double u, double v) {
  const double theta = kPi * std::hypot(2 * u - 1, 2 * v - 1);
  return theta > 0 ? std::sin(theta) / theta : 1;
}

// Direction of a point of a map, empty outside of its disk.
std::optional<Direction3<EnvironmentSpace, double>> directionIn(EnvironmentMapping mapping, double u,
                                                                double v) {
  switch (mapping) {
  case EnvironmentMapping::latLong:
    return latLongDirection(u, v);
  case EnvironmentMapping::angular:
    return angularDirection(u, v);
  case EnvironmentMapping::mirrorBall:
    return mirrorBallDirection(u, v);
  }
  return std::nullopt;
}

// Solid angles of the texels of a disk, up to a constant factor.
double diskDensity(EnvironmentMapping mapping, double u, double v) {
  return mapping == EnvironmentMapping::angular ? angularDensity(u, v) : 1;
}

// In double, as a map may have millions of texels.
double energyOf(const Rgb& light) { return double{light.r} + light.g + light.b; }

// A range of lights, with the moments that determine where it is cut.
struct Cell {
  size_t begin = 0, end = 0;
  double energy = 0;                        // sum of channels
  Vec3<double> mean = Vec3<double>::Zero(); // mean direction, weighted by energy
  int widest = 0;                           // axis of the greatest variance
  double spread = 0;                        // sum over axes of energy times variance

  // Orders by spread, ties by position.
  friend bool operator<(const Cell& a, const Cell& b) {
    return a.spread != b.spread ? a.spread < b.spread : a.begin > b.begin;
  }
};

Cell cellOf(std::span<const EnvironmentLight> lights, size_t begin, size_t end, const Progress& progress) {
  Cell cell{begin, end};
  for (size_t i = begin; i < end; ++i) {
    progress.checkNowAndThen(i);
    const double strength = energyOf(lights[i].irradiance);
    cell.energy += strength;
    cell.mean += strength * lights[i].towards.raw().cast<double>();
  }
  cell.mean /= cell.energy;
  Vec3<double> moments = Vec3<double>::Zero();
  for (size_t i = begin; i < end; ++i) {
    progress.checkNowAndThen(i);
    const Vec3<double> off = lights[i].towards.raw().cast<double>() - cell.mean;
    moments += energyOf(lights[i].irradiance) * off.cwiseAbs2();
  }
  moments.maxCoeff(&cell.widest);
  cell.spread = moments.sum();
  return cell;
}

EnvironmentLight lightOf(std::span<const EnvironmentLight> lights, const Cell& cell) {
  Vec3<double> sum = Vec3<double>::Zero(); // in double, so that a million texels keep their digits
  for (const EnvironmentLight& light : lights.subspan(cell.begin, cell.end - cell.begin))
    sum += Vec3<double>(light.irradiance.r, light.irradiance.g, light.irradiance.b);
  // Opposite directions may cancel; then the first one is used.
  const Vec3<double> towards =
      cell.mean.norm() > 1e-6 ? cell.mean.normalized() : lights[cell.begin].towards.raw().cast<double>();
  return {assume<Direction3<EnvironmentSpace>>(towards),
          {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])},
          static_cast<float>(cell.spread / cell.energy)};
}

} // namespace

Direction3<EnvironmentSpace, double> latLongDirection(double u, double v) {
  const double polar = kPi * v, longitude = 2 * kPi * (u - 0.5);
  return {std::sin(polar) * std::sin(longitude), std::cos(polar), -std::sin(polar) * std::cos(longitude)};
}

std::optional<Direction3<EnvironmentSpace, double>> angularDirection(double u, double v) {
  const double right = 2 * u - 1, up = 1 - 2 * v, r = std::hypot(right, up);
  if (r > 1) return std::nullopt;
  const double theta = kPi * r, across = r > 0 ? std::sin(theta) / r : 0;
  return Direction3<EnvironmentSpace, double>{across * right, across * up, -std::cos(theta)};
}

std::optional<Direction3<EnvironmentSpace, double>> mirrorBallDirection(double u, double v) {
  const double x = 2 * u - 1, y = 1 - 2 * v, zz = 1 - x * x - y * y; // the normal is (x, y, sqrt(zz))
  if (zz < 0) return std::nullopt;
  const double z = std::sqrt(zz);
  return Direction3<EnvironmentSpace, double>{2 * z * x, 2 * z * y, 2 * zz - 1};
}

EnvironmentMap environmentOf(const image::Image& radiance, EnvironmentMapping mapping,
                             const Progress& progress) {
  const auto count = static_cast<double>(radiance.values.size()) / radiance.channels;
  const int parts = static_cast<int>(
      std::ceil(std::sqrt(static_cast<double>(kLeastParts) / count))); // along a texel's side
  const int width = radiance.width * parts, height = radiance.height * parts;
  // Direction of a part. Empty outside of a disk, to which a texel belongs by its middle.
  const auto directionOf = [&](int x, int y) {
    const auto middle =
        directionIn(mapping, (x / parts + 0.5) / radiance.width, (y / parts + 0.5) / radiance.height);
    return middle ? directionIn(mapping, (x + 0.5) / width, (y + 0.5) / height) : std::nullopt;
  };
  const auto densitySum = [&] { // of the parts in a disk, whose solid angles are scaled to 4 pi
    double sum = 0;
    for (int y = 0; y < height; ++y) {
      progress.checkpoint();
      for (int x = 0; x < width; ++x)
        if (directionOf(x, y)) sum += diskDensity(mapping, (x + 0.5) / width, (y + 0.5) / height);
    }
    return sum;
  };
  const bool isDisk = mapping != EnvironmentMapping::latLong;
  const double scale = isDisk ? 4 * kPi / densitySum() : 1;

  EnvironmentMap map;
  std::vector<bool> isReplaced(static_cast<size_t>(count)), isClamped(isReplaced.size());
  for (int y = 0; y < height; ++y) {
    progress.checkpoint();
    for (int x = 0; x < width; ++x) {
      const auto towards = directionOf(x, y);
      if (!towards) continue;
      const double solidAngle = isDisk ? scale * diskDensity(mapping, (x + 0.5) / width, (y + 0.5) / height)
                                       : latLongSolidAngle(y, width, height);
      const auto samples = radiance.at(x / parts, y / parts);
      const auto texel = static_cast<size_t>(y / parts) * static_cast<size_t>(radiance.width) +
                         static_cast<size_t>(x / parts);
      const auto irradiance = [&](size_t channel) {
        float sample = samples[radiance.channels >= 3 ? channel : 0];
        if (!(sample >= 0)) {
          isReplaced[texel] = true;
          return 0.f;
        }
        if (std::isinf(sample)) {
          isClamped[texel] = true;
          sample = kLargestHalf;
        }
        return static_cast<float>(solidAngle * sample);
      };
      const Rgb light{irradiance(0), irradiance(1), irradiance(2)};
      if (light != Rgb{}) map.lights.push_back({towards->cast<float>(), light});
    }
  }
  map.replaced = static_cast<size_t>(std::ranges::count(isReplaced, true));
  map.clamped = static_cast<size_t>(std::ranges::count(isClamped, true));
  return map;
}

namespace {

// Converts a floating-point picture to linear Rec. 709.
image::Image linearRec709(image::Picture picture, const std::filesystem::path& path) {
  if (!picture.color) return std::move(picture.image);
  if (!picture.color->problem.empty()) throw Error(picture.color->problem).at(picture.color->source).in(path);
  const image::ColorDecoder decoder(picture.color->encoding, {});
  if (!decoder.profile() && !decoder.mixesChannels()) return std::move(picture.image); // Rec. 709
  image::Image colors(picture.image.width, picture.image.height, picture.image.channels >= 3 ? 3 : 1);
  for (size_t i = 0; i < colors.values.size(); ++i) {
    const auto channels = static_cast<size_t>(colors.channels);
    colors.values[i] =
        picture.image.values[i / channels * static_cast<size_t>(picture.image.channels) + i % channels];
  }
  return image::decoded(colors, decoder);
}

} // namespace

EnvironmentMap readEnvironment(const std::filesystem::path& path, std::optional<EnvironmentMapping> mapping,
                               const Progress& progress) {
  constexpr int64_t mostPixels = int64_t{1} << 25;
  const image::PictureSize size = image::readPictureSize(path);
  const std::string found = std::to_string(size.width) + " x " + std::to_string(size.height);
  if (int64_t{size.width} * size.height > mostPixels)
    throw Error::mismatch("an environment of at most 2^25 pixels", found).in(path);
  if (!mapping && size.width == 2 * size.height) mapping = EnvironmentMapping::latLong;
  const bool isCross = 4 * size.width == 3 * size.height || 3 * size.width == 4 * size.height;
  if (!mapping)
    throw Error::mismatch("twice as wide as high (lat-long), or a mapping (in a script, mapping = "
                          "\"angular\" or \"mirror_ball\"; else --mapping)",
                          found + (isCross ? " (a cube cross?)" : ""))
        .in(path);
  image::Picture picture = image::readPicture(path);
  if (!picture.isFloat())
    throw Error::mismatch("radiance in floating point (EXR, HDR)",
                          std::to_string(picture.bits) + "-bit samples")
        .in(path);
  EnvironmentMap map = environmentOf(linearRec709(std::move(picture), path), *mapping, progress);
  const Rgb total = totalIrradiance(map.lights);
  if (!(std::isfinite(total.r) && std::isfinite(total.g) && std::isfinite(total.b)))
    throw Error::mismatch("light whose sum is within float", "more").in(path);
  return map;
}

std::vector<EnvironmentLight> clusteredLights(std::vector<EnvironmentLight> lights, double spread,
                                              const Progress& progress) {
  if (lights.empty()) return lights;
  std::vector<Cell> whole; // cells that need no further cut
  std::priority_queue<Cell> cells;
  cells.push(cellOf(lights, 0, lights.size(), progress));
  const double energy = cells.top().energy;
  double spreads = cells.top().spread;
  while (!cells.empty() && spreads > spread * energy && cells.size() + whole.size() < kMaxClusteredLights) {
    progress.checkpoint();
    const Cell cell = cells.top();
    cells.pop();
    const auto begin = lights.begin() + static_cast<std::ptrdiff_t>(cell.begin);
    const auto end = lights.begin() + static_cast<std::ptrdiff_t>(cell.end);
    const auto cut = std::partition(begin, end, [&](const EnvironmentLight& light) {
      return light.towards.raw()[cell.widest] < cell.mean[cell.widest];
    });
    if (cut == begin || cut == end) { // all directions coincide
      whole.push_back(cell);
      continue;
    }
    const auto middle = static_cast<size_t>(cut - lights.begin());
    const Cell halves[] = {cellOf(lights, cell.begin, middle, progress),
                           cellOf(lights, middle, cell.end, progress)};
    spreads += halves[0].spread + halves[1].spread - cell.spread;
    for (const Cell& half : halves) cells.push(half);
  }
  for (; !cells.empty(); cells.pop()) whole.push_back(cells.top());
  std::ranges::sort(whole, {}, &Cell::begin);
  std::vector<EnvironmentLight> result;
  for (const Cell& cell : whole) {
    progress.checkpoint();
    result.push_back(lightOf(lights, cell));
  }
  return result;
}

size_t moveKeyLightsFirst(std::span<EnvironmentLight> lights) {
  double total = 0;
  for (const EnvironmentLight& light : lights) total += energyOf(light.irradiance);
  double least = total * std::min(2 / static_cast<double>(lights.size()), 1. / 16);
  const auto isKey = [&](const EnvironmentLight& light) {
    return light.spread <= kKeySpread && energyOf(light.irradiance) >= least;
  };
  std::vector<double> strengths;
  for (const EnvironmentLight& light : lights)
    if (isKey(light)) strengths.push_back(energyOf(light.irradiance));
  if (strengths.size() > kMostKeyLights) {
    const auto weakest = strengths.begin() + kMostKeyLights - 1;
    std::ranges::nth_element(strengths, weakest, std::greater());
    least = *weakest;
  }
  const auto others = std::ranges::stable_partition(lights, isKey);
  return lights.size() - others.size();
}

Rgb totalIrradiance(std::span<const EnvironmentLight> lights) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (const EnvironmentLight& light : lights)
    sum += Vec3<double>(light.irradiance.r, light.irradiance.g, light.irradiance.b);
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

} // namespace surflect::weights
