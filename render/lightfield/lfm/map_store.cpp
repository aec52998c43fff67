#include "render/lightfield/lfm/map_store.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/patch_grid.h"
#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/root_radiance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

namespace surflect::lfm {

namespace {

// Means above this many times the root of white are cut off, so that few bright samples do not take all
// codes.
constexpr double kBrightestMean = 2;

std::vector<uint8_t> bytesOfMap(std::span<const float> map, float scale, Method method) {
  if (method == Method::nmf) return unorm8Of(map, scale);
  const std::vector<int8_t> codes = snorm8Of(map, scale);
  return {codes.begin(), codes.end()};
}

} // namespace

MapStore::MapStore(LightFieldMaps empty, const Rings& rings)
    : maps_(std::move(empty)), rings_(rings), samples_(PatchGrid::samples(maps_.samples)) {
  if (maps_.method == Method::pca)
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
  if (maps_.method == Method::pca) storeMeans(white);
  return withoutZeros(std::move(maps_));
}

} // namespace surflect::lfm
