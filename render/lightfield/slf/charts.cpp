#include "render/lightfield/slf/charts.h"

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/parametrization.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace surflect::slf {

namespace {

// Texels along an axis that has so many spacings between texels: the outermost half texels are a gutter.
int sideOf(double spacings) {
  if (!(spacings < kLongestSide - 1))
    throw Error::mismatch("textures of at most " + std::to_string(kLongestSide) + " texels a side",
                          numberText(spacings + 1) + " for a region")
        .at("texel size");
  return std::max(kShortestSide, static_cast<int>(std::lround(spacings)) + 1);
}

// Spacings along both axes: the chart's area in texels is that of the surface, and its aspect is the best.
std::array<double, 2> spacingsOf(const StretchSums& stretch, double texelSize) {
  if (!(stretch.area > 0)) return {0, 0};
  const double side = std::sqrt(stretch.area / stretch.planeArea) / texelSize;
  const double aspect = std::sqrt(stretch.bestAspect());
  return {side * aspect, side / aspect};
}

float withGutter(double x, int side) {
  return static_cast<float>((0.5 + std::clamp(x, 0.0, 1.0) * (side - 1)) / side);
}

// Positive triangles within a convex border cover each of its points once; rounding keeps the order of
// vertices along each side.
bool isOneToOne(const Chart& chart) {
  const auto at = [&](uint32_t v) -> Vec2<double> { return chart.coordinates[v].cast<double>(); };
  return std::ranges::all_of(chart.triangles, [&](const auto& corners) {
    return planeArea(at(corners[0]), at(corners[1]), at(corners[2])) > 0;
  });
}

// A disc with its map.
struct MappedDisc {
  Disc disc;
  Parametrization map;
};

// None if rounding makes it fold over.
std::optional<Chart> chartOf(const MappedDisc& mapped, double texelSize) {
  const auto& [disc, map] = mapped;
  if (!std::isfinite(map.stretch.a + map.stretch.c)) return std::nullopt;
  Chart chart;
  chart.vertices = disc.vertices;
  chart.triangles = disc.triangles;
  chart.meshTriangles = disc.meshTriangles;
  const std::array<double, 2> spacings = spacingsOf(map.stretch, texelSize);
  chart.width = sideOf(spacings[0]), chart.height = sideOf(spacings[1]);
  for (const Vec2<double>& p : map.coordinates)
    chart.coordinates.emplace_back(withGutter(p.x(), chart.width), withGutter(p.y(), chart.height));
  if (!isOneToOne(chart)) return std::nullopt;
  return chart;
}

// Maps a disc; its parts where it cannot be mapped as a whole.
class Mapper {
public:
  Mapper(const TriangleMesh& mesh, double texelSize, const Progress& progress)
      : mesh_(mesh), graph_(triangleGraph(mesh, progress)), texelSize_(texelSize) {}

  void addMaps(std::span<const uint32_t> triangles, std::vector<MappedDisc>& maps) const {
    std::optional<Disc> disc = discOf(mesh_, graph_, triangles);
    assert(disc && "regions are discs");
    MappedDisc mapped{std::move(*disc), {}};
    for (int roughness = 0; roughness <= kRoughest; ++roughness) {
      mapped.map = parametrizationOf(mapped.disc, roughness);
      if (!chartOf(mapped, texelSize_)) continue;
      maps.push_back(std::move(mapped));
      return;
    }
    assert(triangles.size() > 1 && "a triangle alone can always be mapped");
    TriangleMesh part{mesh_.positions, {}};
    for (const uint32_t t : triangles) part.triangles.push_back(mesh_.triangles[t]);
    const Regions halves =
        regionsOf(part, {.regions = 2, .widestCone = Angle::fromRadians(std::numbers::pi)});
    for (std::vector<uint32_t>& half : halves.triangles()) {
      for (uint32_t& t : half) t = triangles[t];
      addMaps(half, maps);
    }
  }

private:
  const TriangleMesh& mesh_;
  const TriangleGraph graph_;
  const double texelSize_;
};

void requireTexelSize(double texelSize) {
  if (!(texelSize > 0 && std::isfinite(texelSize)))
    throw Error::mismatch("a positive number", numberText(texelSize)).at("texel size");
}

std::vector<MappedDisc> mapsOf(const TriangleMesh& mesh, const Regions& regions, double texelSize,
                               const Progress& progress) {
  const Mapper mapper(mesh, texelSize, progress);
  const std::vector<std::vector<uint32_t>> triangles = regions.triangles();
  std::vector<std::vector<MappedDisc>> maps(regions.count);
  size_t done = 0;
  std::mutex reporting;
  tbb::parallel_for(size_t{0}, regions.count, [&](size_t region) {
    progress.checkpoint();
    mapper.addMaps(triangles[region], maps[region]);
    const std::lock_guard lock(reporting);
    progress("charts", static_cast<double>(++done) / static_cast<double>(regions.count));
  });
  std::vector<MappedDisc> result;
  for (std::vector<MappedDisc>& some : maps)
    for (MappedDisc& mapped : some) result.push_back(std::move(mapped));
  return result;
}

// Number of texels of all charts.
size_t texelsOf(std::span<const MappedDisc> maps, double texelSize) {
  size_t texels = 0;
  for (const MappedDisc& mapped : maps) {
    const std::array<double, 2> spacings = spacingsOf(mapped.map.stretch, texelSize);
    texels += static_cast<size_t>(sideOf(spacings[0])) * static_cast<size_t>(sideOf(spacings[1]));
  }
  return texels;
}

// Charts of maps; a map that rounding makes fold over at this size is made anew.
std::vector<Chart> chartsOf(const TriangleMesh& mesh, std::span<const MappedDisc> maps, double texelSize,
                            const Progress& progress) {
  std::vector<Chart> charts;
  for (const MappedDisc& mapped : maps) {
    if (std::optional<Chart> chart = chartOf(mapped, texelSize)) {
      charts.push_back(std::move(*chart));
      continue;
    }
    std::vector<MappedDisc> parts;
    Mapper(mesh, texelSize, progress).addMaps(mapped.disc.meshTriangles, parts);
    for (const MappedDisc& part : parts) charts.push_back(chartOf(part, texelSize).value());
  }
  return charts;
}

} // namespace

std::vector<Chart> chartsOf(const TriangleMesh& mesh, const Regions& regions, double texelSize,
                            const Progress& progress) {
  requireTexelSize(texelSize);
  return chartsOf(mesh, mapsOf(mesh, regions, texelSize, progress), texelSize, progress);
}

FittedCharts fittedCharts(const TriangleMesh& mesh, const Regions& regions, double texelSize,
                          size_t mostTexels, const Progress& progress) {
  requireTexelSize(texelSize);
  const std::vector<MappedDisc> maps = mapsOf(mesh, regions, texelSize, progress);
  constexpr int kMostSteps = 8; // sides of 4 texels cannot get shorter
  for (int step = 0; step < kMostSteps; ++step) {
    const size_t made = texelsOf(maps, texelSize);
    if (made <= mostTexels + mostTexels / 20) break;
    texelSize *= std::sqrt(static_cast<double>(made) / static_cast<double>(mostTexels));
  }
  return {chartsOf(mesh, maps, texelSize, progress), texelSize};
}

} // namespace surflect::slf
