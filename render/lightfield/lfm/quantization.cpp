#include "render/lightfield/lfm/quantization.h"

#include "render/lightfield/lfm/map_shape.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

namespace {

template <class Code, class Encode>
std::vector<Code> codesOf(std::span<const float> map, float scale, const Encode& codeOf) {
  std::vector<Code> codes(map.size());
  if (scale > 0)
    std::ranges::transform(map, codes.begin(), [&](float value) { return codeOf(value / scale); });
  return codes;
}

template <class Code, class Decode>
std::vector<float> valuesOf(std::span<const Code> codes, float scale, const Decode& valueOf) {
  std::vector<float> values(codes.size());
  std::ranges::transform(codes, values.begin(), [&](Code code) { return scale * valueOf(code); });
  return values;
}

// Nearest integer of steps x value; that of 0 for NaN.
long nearest(float value, float least, float steps) {
  return std::isnan(value) ? 0 : std::lround(steps * std::clamp(value, least, 1.0f));
}

} // namespace

int8_t snorm8Of(float value) { return static_cast<int8_t>(nearest(value, -1, 127)); }
uint8_t unorm8Of(float value) { return static_cast<uint8_t>(nearest(value, 0, 255)); }

uint8_t byteOf(Factorization method, float value) {
  return method == Factorization::pca ? static_cast<uint8_t>(snorm8Of(value)) : unorm8Of(value);
}

float scaleOf(std::span<const float> map) {
  float largest = 0;
  for (const float value : map) largest = std::max(largest, std::abs(value));
  return largest;
}

std::vector<int8_t> snorm8Of(std::span<const float> map, float scale) {
  return codesOf<int8_t>(map, scale, [](float value) { return snorm8Of(value); });
}
std::vector<uint8_t> unorm8Of(std::span<const float> map, float scale) {
  return codesOf<uint8_t>(map, scale, [](float value) { return unorm8Of(value); });
}

std::vector<float> decoded(std::span<const int8_t> codes, float scale) {
  return valuesOf(codes, scale, decodedSnorm8);
}
std::vector<float> decoded(std::span<const uint8_t> codes, float scale) {
  return valuesOf(codes, scale, decodedUnorm8);
}

namespace {

// Weights of a map's bytes when maps are compared: for surface maps the hat function of corner 0; 1 for
// others.
std::vector<float> byteWeightsOf(const MapShape& shape) {
  std::vector<float> byteWeights(shape.bytes(), 1);
  if (shape.kind != MapShape::Kind::patch || shape.channels != 1) return byteWeights;
  const PatchGrid grid(shape.size);
  for (size_t sample = 0; sample < byteWeights.size(); ++sample)
    byteWeights[sample] = static_cast<float>(grid.barycentrics(sample)[0]);
  return byteWeights;
}

// Values of a codeword, divided by the weights. On the edge opposite to corner 0 these are 0, and values are
// those of the samples beside it.
std::vector<float> withoutWeights(std::span<const float> codeword, std::span<const float> byteWeights,
                                  const MapShape& shape) {
  std::vector<float> values(codeword.begin(), codeword.end());
  const PatchGrid grid(shape.size);
  const auto valueOf = [&](size_t i) { return codeword[i] / byteWeights[i]; };
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = byteWeights[i] > 0 ? valueOf(i) : valueOf(grid.besideFarEdge(i, 0));
  return values;
}

// Codebook for the maps of all users whose weight is above 0. `method` tells how bytes are read.
MapTable codebookTable(const MapTable& table, const MapShape& shape, Factorization method,
                       std::span<const float> weightOf, const MapCodebookOptions& options,
                       const Progress& progress) {
  assert(table.maps.coding == Coding::bytes);
  const std::vector<float> byteWeights = byteWeightsOf(shape);
  std::vector<uint32_t> users;
  std::vector<float> values, weights;
  for (uint32_t user = 0; user < table.mapOf.size(); ++user) {
    if (table.mapOf[user] == kNoMap || !(weightOf[user] > 0)) continue;
    users.push_back(user);
    weights.push_back(weightOf[user]);
    const uint8_t* map = &table.maps.data[table.mapOf[user] * shape.bytes()];
    for (size_t i = 0; i < shape.bytes(); ++i)
      values.push_back(byteWeights[i] * static_cast<float>(valueOf(method, map[i])));
  }
  MapTable result;
  result.mapOf.assign(table.mapOf.size(), kNoMap);
  if (users.empty()) return result;
  CodebookOptions bounds;
  bounds.start = options.start;
  bounds.distortion = options.distortion;
  if (options.ratio > 0)
    bounds.codewords = static_cast<size_t>(std::ceil(static_cast<double>(users.size()) / options.ratio));
  const Codebook codebook = codebookOf({shape.bytes(), values, weights}, bounds, progress);
  result.maps.count = codebook.size();
  for (size_t codeword = 0; codeword < codebook.size(); ++codeword)
    for (const float value : withoutWeights(codebook.codeword(codeword), byteWeights, shape))
      result.maps.data.push_back(byteOf(method, value));
  for (size_t i = 0; i < users.size(); ++i) result.mapOf[users[i]] = codebook.indices[i];
  return result;
}

} // namespace

LightFieldMaps withCodebooks(const LightFieldMaps& maps, const MapCodebookOptions& options,
                             const Progress& progress) {
  if (!(options.ratio > 0 || options.distortion > 0))
    throw Error("neither a ratio nor a distortion above 0").at("codebooks");
  LightFieldMaps result = maps;
  result.layout = SurfaceLayout::scalar;
  for (size_t k = 0; k < result.terms.size(); ++k) {
    Term& term = result.terms[k];
    if (maps.layout == SurfaceLayout::packed) term.surface = scalarTable(term.surface, maps.samples);
    std::vector<float> surfaceWeights, viewWeights;
    for (const auto& triangle : maps.mesh.triangles)
      for (const uint32_t vertex : triangle)
        surfaceWeights.push_back(term.scale[vertex] * term.scale[vertex]);
    for (const float scale : term.scale) viewWeights.push_back(scale * scale);
    term.surface =
        codebookTable(term.surface, surfaceShape(result), maps.method, surfaceWeights, options, progress);
    term.view = codebookTable(term.view, viewShape(result, k), maps.method, viewWeights, options, progress);
  }
  if (options.means && !maps.mean.mapOf.empty())
    result.mean = codebookTable(maps.mean, meanShape(result), Factorization::nmf,
                                std::vector<float>(maps.mean.mapOf.size(), 1), options, progress);
  return result;
}

} // namespace surflect::lfm
