#include "render/lightfield/lfm/quantization.h"

#include <algorithm>
#include <cmath>

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

} // namespace surflect::lfm
