#include "render/lightfield/lfm/radiance.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/root_radiance.h"

#include <algorithm>
#include <cassert>

namespace surflect::lfm {

namespace {

const uint8_t* mapOf(const MapSet& maps, const MapShape& shape, uint32_t map) {
  assert(maps.coding == Coding::bytes);
  return &maps.data[map * shape.bytes()];
}

// Values of `channels` bytes.
Channels decodedChannels(const LightFieldMaps& maps, const uint8_t* bytes, const auto& valueOfByte) {
  Channels values(static_cast<Eigen::Index>(maps.channels));
  for (size_t c = 0; c < maps.channels; ++c) values[static_cast<Eigen::Index>(c)] = valueOfByte(bytes[c]);
  return values;
}

// Barycentrics of a place, the hat functions of the corners.
Vec3<double> hatsAt(const TrianglePlace& place) { return {1 - place.b - place.c, place.b, place.c}; }

Channels zeros(const LightFieldMaps& maps) {
  return Channels::Zero(static_cast<Eigen::Index>(maps.channels));
}

} // namespace

Vec3<double> surfaceValues(const LightFieldMaps& maps, size_t number, const TrianglePlace& place,
                           const EdgeCorrections& edges) {
  const Term& term = maps.terms[number];
  const PatchGrid grid(maps.samples);
  const MapShape shape = surfaceShape(maps);
  const PatchBlend blend = blendAt(maps.samples, place.b, place.c);
  const Vec3<double> hats = hatsAt(place);
  Vec3<double> sum = Vec3<double>::Zero();
  for (size_t corner = 0; corner < 3; ++corner) {
    const bool isPacked = maps.layout == SurfaceLayout::packed;
    const uint32_t map = term.surface.mapOf[isPacked ? place.triangle : 3 * place.triangle + corner];
    double& value = sum[static_cast<Eigen::Index>(corner)];
    value = surfaceCorrection(edges, place.triangle, number, corner, hats.cwiseMax(0));
    if (map == kNoMap) continue;
    const uint8_t* values = mapOf(term.surface.maps, shape, map);
    for (size_t i = 0; i < 3; ++i) {
      const size_t sample = isPacked ? 3 * grid.index(blend.places[i]) + corner
                                     : grid.index(turned(maps.samples, blend.places[i], corner));
      value += blend.weights[i] * valueOf(maps.method, values[sample]);
    }
  }
  return hats.cwiseProduct(sum);
}

Channels viewValue(const LightFieldMaps& maps, size_t number, uint32_t vertex, const DiscPoint& point) {
  const Term& term = maps.terms[number];
  const uint32_t map = term.view.mapOf[vertex];
  if (map == kNoMap) return zeros(maps);
  const uint8_t* values = mapOf(term.view.maps, viewShape(maps, number), map);
  const int size = viewSizeOf(maps, number);
  const double x = std::clamp(point.x() * size - 0.5, 0.0, size - 1.0);
  const double y = std::clamp(point.y() * size - 0.5, 0.0, size - 1.0);
  const int x0 = std::min(static_cast<int>(x), size - 2), y0 = std::min(static_cast<int>(y), size - 2);
  const double a = x - x0, b = y - y0;
  const auto at = [&](int i, int j) {
    const size_t cell = static_cast<size_t>(j) * static_cast<size_t>(size) + static_cast<size_t>(i);
    return decodedChannels(maps, values + maps.channels * cell,
                           [&](uint8_t byte) { return valueOf(maps.method, byte); });
  };
  return (1 - b) * ((1 - a) * at(x0, y0) + a * at(x0 + 1, y0)) + //
         b * ((1 - a) * at(x0, y0 + 1) + a * at(x0 + 1, y0 + 1));
}

Channels meanValue(const LightFieldMaps& maps, const TrianglePlace& place, const EdgeCorrections& edges) {
  Channels sum = zeros(maps);
  if (maps.mean.mapOf.empty()) return sum;
  for (size_t c = 0; c < maps.channels; ++c)
    sum[static_cast<Eigen::Index>(c)] = meanCorrection(edges, place.triangle, c, hatsAt(place).cwiseMax(0));
  if (maps.mean.mapOf[place.triangle] == kNoMap) return maps.meanWhite * sum;
  const PatchGrid grid(maps.samples);
  const PatchBlend blend = blendAt(maps.samples, place.b, place.c);
  const uint8_t* values = mapOf(maps.mean.maps, meanShape(maps), maps.mean.mapOf[place.triangle]);
  for (size_t i = 0; i < 3; ++i) {
    const uint8_t* bytes = values + maps.channels * grid.index(blend.places[i]);
    sum += blend.weights[i] * decodedChannels(maps, bytes, [](uint8_t byte) { return byte / 255.0; });
  }
  return maps.meanWhite * sum;
}

Channels termValue(const LightFieldMaps& maps, size_t number, const TrianglePlace& place,
                   const std::array<DiscPoint, 3>& points, const EdgeCorrections& edges) {
  const Term& term = maps.terms[number];
  const Vec3<double> surface = surfaceValues(maps, number, place, edges);
  Channels sum = zeros(maps);
  for (size_t corner = 0; corner < 3; ++corner) {
    const uint32_t vertex = maps.mesh.triangles[place.triangle][corner];
    sum += term.scale[vertex] * surface[static_cast<Eigen::Index>(corner)] *
           viewValue(maps, number, vertex, points[corner]);
  }
  return sum;
}

Channels radianceAt(const LightFieldMaps& maps, const TrianglePlace& place, const Direction& d, size_t terms,
                    const EdgeCorrections& edges) {
  std::array<DiscPoint, 3> points;
  for (size_t corner = 0; corner < 3; ++corner)
    points[corner] = discPoint(maps.frames[maps.mesh.triangles[place.triangle][corner]], d);
  Channels sum = meanValue(maps, place, edges);
  for (size_t k = 0; k < std::min(terms, maps.terms.size()); ++k)
    sum += termValue(maps, k, place, points, edges);
  return sum.unaryExpr([](double root) { return radianceOf(root); });
}

} // namespace surflect::lfm
