#include "render/lightfield/slf/charts.h"

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/parametrization.h"
#include "render/lightfield/slf/plane_border.h"
#include "render/lightfield/slf/stretch.h"
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

// Positive triangles within a border that does not cross itself cover each of its points once.
bool isOneToOne(const Chart& chart, std::span<const uint32_t> border) {
  const auto at = [&](uint32_t v) -> Vec2<double> { return chart.coordinates[v].cast<double>(); };
  for (const auto& [i, j, k] : chart.triangles)
    if (!(planeArea(at(i), at(j), at(k)) > 0)) return false;
  std::vector<Vec2<double>> polygon;
  for (const uint32_t v : border) polygon.push_back(at(v));
  return !crossesItself(polygon);
}

std::optional<Chart> chartOf(const Disc& disc, double texelSize) {
  for (int roughness = 0; roughness <= kRoughest; ++roughness) {
    const Parametrization map = parametrizationOf(disc, roughness);
    if (!std::isfinite(map.stretch.a + map.stretch.c)) continue;
    Chart chart;
    chart.vertices = disc.vertices;
    chart.triangles = disc.triangles;
    chart.meshTriangles = disc.meshTriangles;
    const std::array<double, 2> spacings = spacingsOf(map.stretch, texelSize);
    chart.width = sideOf(spacings[0]), chart.height = sideOf(spacings[1]);
    for (const Vec2<double>& p : map.coordinates)
      chart.coordinates.emplace_back(withGutter(p.x(), chart.width), withGutter(p.y(), chart.height));
    if (isOneToOne(chart, disc.border)) return chart;
  }
  return std::nullopt;
}

// Charts of a disc; of its parts where it cannot be mapped as a whole.
void addCharts(const TriangleMesh& mesh, const TriangleGraph& graph, std::span<const uint32_t> triangles,
               double texelSize, std::vector<Chart>& charts) {
  const std::optional<Disc> disc = discOf(mesh, graph, triangles);
  assert(disc && "regions are discs");
  if (std::optional<Chart> chart = chartOf(*disc, texelSize)) {
    charts.push_back(std::move(*chart));
    return;
  }
  assert(triangles.size() > 1 && "a triangle alone can always be mapped");
  TriangleMesh part{mesh.positions, {}};
  for (const uint32_t t : triangles) part.triangles.push_back(mesh.triangles[t]);
  const Regions halves = regionsOf(part, {.regions = 2, .widestCone = Angle::fromRadians(std::numbers::pi)});
  for (std::vector<uint32_t>& half : halves.triangles()) {
    for (uint32_t& t : half) t = triangles[t];
    addCharts(mesh, graph, half, texelSize, charts);
  }
}

} // namespace

std::vector<Chart> chartsOf(const TriangleMesh& mesh, const Regions& regions, double texelSize,
                            const Progress& progress) {
  if (!(texelSize > 0 && std::isfinite(texelSize)))
    throw Error::mismatch("a positive number", numberText(texelSize)).at("texel size");
  const TriangleGraph graph = triangleGraph(mesh, progress);
  const std::vector<std::vector<uint32_t>> triangles = regions.triangles();
  std::vector<std::vector<Chart>> charts(regions.count);
  size_t done = 0;
  std::mutex reporting;
  tbb::parallel_for(size_t{0}, regions.count, [&](size_t region) {
    progress.checkpoint();
    addCharts(mesh, graph, triangles[region], texelSize, charts[region]);
    const std::lock_guard lock(reporting);
    progress("charts", static_cast<double>(++done) / static_cast<double>(regions.count));
  });
  std::vector<Chart> result;
  for (std::vector<Chart>& some : charts)
    for (Chart& chart : some) result.push_back(std::move(chart));
  return result;
}

} // namespace surflect::slf
