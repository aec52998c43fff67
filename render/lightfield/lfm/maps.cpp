#include "render/lightfield/lfm/maps.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace surflect::lfm {

namespace {

std::string text(size_t number) { return std::to_string(number); }

void require(size_t found, size_t expected, const char* field) {
  if (found != expected) throw Error::mismatch(text(expected), text(found)).at(field);
}

void requireWithin(size_t found, size_t lowest, size_t highest, const char* field) {
  if (found < lowest || found > highest)
    throw Error::mismatch(text(lowest) + ".." + text(highest), text(found)).at(field);
}

void requireTable(const MapTable& table, size_t users, const MapShape& shape) {
  require(table.mapOf.size(), users, "mapOf");
  for (size_t i = 0; i < users; ++i)
    if (table.mapOf[i] != kNoMap && table.mapOf[i] >= table.maps.count)
      throw Error::mismatch("below " + text(table.maps.count), text(table.mapOf[i]))
          .at("mapOf[" + text(i) + ']');
  if (table.maps.coding != Coding::bytes && table.maps.coding != compressedCoding(shape))
    throw Error("is not that of maps with so many channels").at("coding");
  require(table.maps.data.size(), bytesOf(shape, table.maps.coding, table.maps.count), "data");
}

void requireNumber(double number, double lowest, const std::string& field) {
  if (!std::isfinite(number) || number < lowest)
    throw Error::mismatch("a number from " + numberText(lowest), numberText(number)).at(field);
}

void requireTerm(const LightFieldMaps& maps, size_t number) {
  const Term& term = maps.terms[number];
  const size_t triangles = maps.mesh.triangles.size(), vertices = maps.mesh.positions.size();
  const bool isPacked = maps.layout == SurfaceLayout::packed;
  try {
    requireTable(term.surface, isPacked ? triangles : 3 * triangles, surfaceShape(maps));
  } catch (Error& error) {
    throw std::move(error).at("surface");
  }
  try {
    requireTable(term.view, vertices, viewShape(maps, number));
  } catch (Error& error) {
    throw std::move(error).at("view");
  }
  if (term.surface.maps.coding != maps.terms[0].surface.maps.coding ||
      term.view.maps.coding != maps.terms[0].view.maps.coding)
    throw Error("differs from the first term's").at("coding");
  require(term.scale.size(), vertices, "scale");
  for (size_t v = 0; v < vertices; ++v) requireNumber(term.scale[v], 0, "scale[" + text(v) + ']');
}

} // namespace

MapBytes bytesOf(const LightFieldMaps& maps) {
  MapBytes bytes;
  const auto indices = [](const MapTable& table) {
    return isIdentity(table) ? 0 : table.mapOf.size() * indexBytes(table);
  };
  for (const Term& term : maps.terms) {
    bytes.surface += term.surface.maps.data.size();
    bytes.view += term.view.maps.data.size();
    bytes.indices += indices(term.surface) + indices(term.view);
    bytes.scales += term.scale.size() * sizeof(float);
  }
  bytes.mean = maps.mean.maps.data.size();
  bytes.indices += indices(maps.mean);
  return bytes;
}

bool isIdentity(const MapTable& table) {
  if (table.mapOf.size() != table.maps.count) return false;
  for (size_t i = 0; i < table.mapOf.size(); ++i)
    if (table.mapOf[i] != i) return false;
  return true;
}

void requireComplete(const LightFieldMaps& maps) {
  require(maps.frames.size(), maps.mesh.positions.size(), "frames");
  requireWithin(static_cast<size_t>(maps.samples), 2, PatchGrid::kMostPerEdge, "samples");
  requireWithin(static_cast<size_t>(maps.viewSize), kLeastViewSize, kLargestViewSize, "viewSize");
  requireWithin(static_cast<size_t>(maps.higherViewSize), kLeastViewSize, kLargestViewSize, "higherViewSize");
  requireWithin(maps.channels, 3, 4, "channels");
  requireWithin(maps.terms.size(), 0, kMostTerms, "terms");
  for (size_t k = 0; k < maps.terms.size(); ++k) try {
      requireTerm(maps, k);
    } catch (Error& error) {
      throw std::move(error).at("terms[" + text(k) + ']');
    }
  try {
    requireTable(maps.mean, maps.method == Factorization::pca ? maps.mesh.triangles.size() : 0,
                 meanShape(maps));
  } catch (Error& error) {
    throw std::move(error).at("mean");
  }
  requireNumber(maps.meanWhite, 1e-30, "meanWhite");
}

namespace {

// Means above this many times the root of white are cut off, so that few bright samples do not take all
// codes.
constexpr double kBrightestMean = 2;

std::vector<uint8_t> bytesOfMap(std::span<const float> map, float scale, Factorization method) {
  if (method == Factorization::nmf) return unorm8Of(map, scale);
  const std::vector<int8_t> codes = snorm8Of(map, scale);
  return {codes.begin(), codes.end()};
}

} // namespace

MapStore::MapStore(LightFieldMaps empty, const Rings& rings)
    : maps_(std::move(empty)), rings_(rings), samples_(PatchGrid::samples(maps_.samples)) {
  if (maps_.method == Factorization::pca)
    meanShares_.assign(3 * maps_.channels * samples_ * maps_.mesh.triangles.size(), 0.f);
}

std::span<float> MapStore::meanShare(size_t triangle, size_t sample, size_t corner) {
  return std::span(meanShares_)
      .subspan(maps_.channels * (3 * (triangle * samples_ + sample) + corner), maps_.channels);
}

float MapStore::meanOf(size_t triangle, size_t sample, size_t channel) const {
  const float* share = &meanShares_[3 * maps_.channels * (triangle * samples_ + sample) + channel];
  // On an edge one is 0, so that the order does not matter.
  return share[0] + share[maps_.channels] + share[2 * maps_.channels];
}

void MapStore::put(const Factors& factors, const RingRows& rows, uint32_t vertex) {
  const std::span<const RingTriangle> ring = rings_.around(vertex);
  const PatchGrid grid(maps_.samples);
  for (size_t k = 0; k < factors.terms.size(); ++k) {
    const FactorTerm& factor = factors.terms[k];
    Term& term = maps_.terms[k];
    std::vector<float> withoutHat(factor.surface);
    for (size_t row = 0; row < rows.rows(); ++row) withoutHat[row] /= rows.hats[row];
    const float surfaceScale = scaleOf(withoutHat), viewScale = scaleOf(factor.view);
    term.scale[vertex] = surfaceScale * viewScale;
    const std::vector<uint8_t> surface = bytesOfMap(withoutHat, surfaceScale, maps_.method),
                               view = bytesOfMap(factor.view, viewScale, maps_.method);
    std::ranges::copy(view, term.view.maps.data.begin() + static_cast<std::ptrdiff_t>(vertex * view.size()));
    for (size_t r = 0; r < ring.size(); ++r)
      for (size_t sample = 0; sample < samples_; ++sample) {
        uint32_t row = rows.rowOf[r * samples_ + sample];
        if (row == RingRows::kNone)
          row = rows.rowOf[r * samples_ + grid.besideFarEdge(sample, ring[r].corner)];
        term.surface.maps.data[3 * (ring[r].triangle * samples_ + sample) + ring[r].corner] = surface[row];
      }
  }
  for (size_t r = 0; r < ring.size() && !factors.mean.empty(); ++r)
    for (size_t sample = 0; sample < samples_; ++sample)
      if (const uint32_t row = rows.rowOf[r * samples_ + sample]; row != RingRows::kNone)
        std::copy_n(&factors.mean[maps_.channels * row], maps_.channels,
                    meanShare(ring[r].triangle, sample, ring[r].corner).begin());
}

void MapStore::storeMeans(double white) {
  const size_t triangles = maps_.mesh.triangles.size();
  float largest = 0;
  for (size_t triangle = 0; triangle < triangles; ++triangle)
    for (size_t sample = 0; sample < samples_; ++sample)
      for (size_t channel = 0; channel < maps_.channels; ++channel)
        largest = std::max(largest, meanOf(triangle, sample, channel));
  if (largest > 0) maps_.meanWhite = std::min(largest, static_cast<float>(kBrightestMean * rootOf(white)));
  tbb::parallel_for(size_t{0}, triangles, [&](size_t triangle) {
    for (size_t sample = 0; sample < samples_; ++sample)
      for (size_t channel = 0; channel < maps_.channels; ++channel)
        maps_.mean.maps.data[maps_.channels * (triangle * samples_ + sample) + channel] = meanByte(
            static_cast<double>(meanOf(triangle, sample, channel)), static_cast<double>(maps_.meanWhite));
  });
}

LightFieldMaps MapStore::maps(double white) && {
  if (maps_.method == Factorization::pca) storeMeans(white);
  return withoutZeros(std::move(maps_));
}

} // namespace surflect::lfm
