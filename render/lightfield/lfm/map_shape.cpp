#include "render/lightfield/lfm/map_shape.h"

#include "render/lightfield/common/sight.h"
#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/rings.h"
#include "surfel/base/error.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/simplify.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

MapTable emptyTable(size_t users, const MapShape& shape) {
  MapTable table;
  table.maps.count = users;
  table.maps.data.resize(users * shape.bytes());
  table.mapOf.resize(users);
  std::iota(table.mapOf.begin(), table.mapOf.end(), 0u);
  return table;
}

// Table without the maps of users that `isUsed` leaves out.
MapTable withUsers(const MapTable& table, const MapShape& shape, const auto& isUsed) {
  MapTable result;
  for (uint32_t user = 0; user < table.mapOf.size(); ++user) {
    const uint32_t map = table.mapOf[user];
    if (map == kNoMap || !isUsed(user)) {
      result.mapOf.push_back(kNoMap);
      continue;
    }
    result.mapOf.push_back(static_cast<uint32_t>(result.maps.count++));
    const auto data = std::span(table.maps.data).subspan(map * shape.bytes(), shape.bytes());
    result.maps.data.insert(result.maps.data.end(), data.begin(), data.end());
  }
  return result;
}

} // namespace

LightFieldMaps emptyMaps(TriangleMesh mesh, std::vector<VertexFrame> frames, Factorization method,
                         int samples, int viewSize, size_t terms, size_t channels) {
  assert(frames.size() == mesh.positions.size());
  LightFieldMaps maps;
  maps.mesh = std::move(mesh);
  maps.frames = std::move(frames);
  maps.method = method;
  maps.samples = samples;
  maps.viewSize = maps.higherViewSize = viewSize;
  maps.channels = channels;
  const size_t vertices = maps.mesh.positions.size(), triangles = maps.mesh.triangles.size();
  for (size_t k = 0; k < terms; ++k)
    maps.terms.push_back({emptyTable(triangles, surfaceShape(maps)), emptyTable(vertices, viewShape(maps, k)),
                          std::vector<float>(vertices, 0)});
  maps.mean = emptyTable(method == Factorization::pca ? triangles : 0, meanShape(maps));
  return maps;
}

LightFieldMaps withoutZeros(LightFieldMaps maps) {
  assert(maps.layout == SurfaceLayout::packed);
  const auto isZero = [](float scale) { return scale == 0; };
  while (!maps.terms.empty() && std::ranges::all_of(maps.terms.back().scale, isZero)) maps.terms.pop_back();
  for (size_t k = 0; k < maps.terms.size(); ++k) {
    Term& term = maps.terms[k];
    if (std::ranges::none_of(term.scale, isZero)) continue;
    term.view = withUsers(term.view, viewShape(maps, k),
                          [&](uint32_t vertex) { return !isZero(term.scale[vertex]); });
    term.surface = withUsers(term.surface, surfaceShape(maps), [&](uint32_t triangle) {
      return std::ranges::any_of(maps.mesh.triangles[triangle],
                                 [&](uint32_t vertex) { return !isZero(term.scale[vertex]); });
    });
  }
  return maps;
}

namespace {

// Cells of a finer grid that one of a coarser grid covers along an axis, and the share that each has in it.
struct Covered {
  int first = 0;
  std::vector<double> shares;
};

// Covered cells of each of `to` cells, at most `from`, along a side.
std::vector<Covered> coverage(int from, int to) {
  std::vector<Covered> all;
  for (int i = 0; i < to; ++i) {
    Covered& covered = all.emplace_back();
    covered.first = i * from / to;
    for (int x = covered.first; x * to < (i + 1) * from; ++x) // in units of 1 / (from to)
      covered.shares.push_back((std::min((i + 1) * from, (x + 1) * to) - std::max(i * from, x * to)) /
                               static_cast<double>(from));
  }
  return all;
}

// Means of the cells of a view map that those of a smaller one cover.
std::vector<float> meansOf(std::span<const uint8_t> map, const MapShape& from, const MapShape& to,
                           const std::vector<Covered>& coverage, Factorization method) {
  std::vector<float> means;
  means.reserve(to.bytes());
  for (const Covered& rows : coverage)
    for (const Covered& columns : coverage)
      for (size_t channel = 0; channel < to.channels; ++channel) {
        double sum = 0;
        for (size_t y = 0; y < rows.shares.size(); ++y)
          for (size_t x = 0; x < columns.shares.size(); ++x) {
            const size_t cell = (static_cast<size_t>(rows.first) + y) * static_cast<size_t>(from.size) +
                                static_cast<size_t>(columns.first) + x;
            sum += rows.shares[y] * columns.shares[x] * valueOf(method, map[from.channels * cell + channel]);
          }
        means.push_back(static_cast<float>(sum));
      }
  return means;
}

} // namespace

LightFieldMaps withHigherViewSize(LightFieldMaps maps, int size, const Progress& progress) {
  assert(maps.layout == SurfaceLayout::packed);
  if (size > maps.higherViewSize)
    throw Error::mismatch("at most " + std::to_string(maps.higherViewSize), std::to_string(size))
        .at("cells of higher view maps");
  if (size == maps.higherViewSize) return maps;
  const MapShape from = viewShape(maps, 1);
  maps.higherViewSize = size;
  const MapShape to = viewShape(maps, 1);
  const std::vector<Covered> covered = coverage(from.size, to.size);
  for (size_t k = 1; k < maps.terms.size(); ++k) {
    Term& term = maps.terms[k];
    MapSet& set = term.view.maps;
    assert(set.coding == Coding::bytes);
    std::vector<uint8_t> bytes(set.count * to.bytes());
    std::vector<float> peaks(set.count); // of the means, which are less than those of the cells
    tbb::parallel_for(size_t{0}, set.count, [&](size_t map) {
      progress.checkpoint();
      const std::vector<float> means = meansOf(std::span(set.data).subspan(map * from.bytes(), from.bytes()),
                                               from, to, covered, maps.method);
      peaks[map] = scaleOf(means);
      for (size_t i = 0; i < means.size(); ++i)
        bytes[map * to.bytes() + i] = byteOf(maps.method, peaks[map] > 0 ? means[i] / peaks[map] : 0);
    });
    set.data = std::move(bytes);
    for (size_t vertex = 0; vertex < term.scale.size(); ++vertex)
      if (const uint32_t map = term.view.mapOf[vertex]; map != kNoMap) term.scale[vertex] *= peaks[map];
  }
  return withoutZeros(std::move(maps));
}

MapTable scalarTable(const MapTable& packed, int samples) {
  assert(packed.maps.coding == Coding::bytes);
  const PatchGrid grid(samples);
  const size_t count = grid.samples();
  MapTable table{{Coding::bytes, 3 * packed.maps.count, std::vector<uint8_t>(packed.maps.data.size())}, {}};
  for (size_t corner = 0; corner < 3; ++corner)
    for (size_t sample = 0; sample < count; ++sample) {
      const size_t to = grid.index(turned(samples, grid.place(sample), corner));
      for (size_t map = 0; map < packed.maps.count; ++map)
        table.maps.data[(3 * map + corner) * count + to] =
            packed.maps.data[3 * (map * count + sample) + corner];
    }
  for (const uint32_t map : packed.mapOf)
    for (uint32_t corner = 0; corner < 3; ++corner)
      table.mapOf.push_back(map == kNoMap ? kNoMap : 3 * map + corner);
  return table;
}

namespace {

// Width of a pixel on the views' mesh, and the mesh's area in pixels.
struct MeshPixels {
  double width = 0, count = 0;
};

MeshPixels pixelsOf(const lightfield::Views& views) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const size_t view : views.ofSplit(capture::Split::train)) cameras.push_back(views.camera(view));
  const double pixel = lightfield::pixelFootprint(views.mesh(), cameras);
  return {pixel, pixel > 0 ? surfaceArea(views.mesh()) / (pixel * pixel) : 0};
}

int samplesOf(int samples, double pixels, const TriangleMesh& mesh) {
  const auto count = static_cast<double>(std::max<size_t>(1, mesh.triangles.size()));
  return samples > 0 ? samples : samplesPerEdgeFor(pixels / count);
}

} // namespace

int samplesFor(const lightfield::Views& views, int samples) {
  return samplesOf(samples, pixelsOf(views).count, views.mesh());
}

Resolution resolutionFor(const lightfield::Views& views, size_t triangles, int samples) {
  const TriangleMesh& mesh = views.mesh();
  const auto [pixel, pixels] = pixelsOf(views);
  Resolution result;
  if (triangles > 0)
    result.mesh = simplified(mesh, triangles);
  else
    result.mesh =
        simplified(mesh, static_cast<size_t>(std::max(4., std::ceil(pixels / kPixelsPerTriangle))), pixel);
  result.samples = samplesOf(samples, pixels, result.mesh);
  return result;
}

} // namespace surflect::lfm
