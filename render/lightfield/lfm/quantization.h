// Maps in bytes, decoded as OpenGL decodes normalised textures, with one scale for all bytes of a map.
//
// A scale belongs to a vertex and a term, so that triangles that share an edge decode equal values there.
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/vector_quantization.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Value of a byte of a signed normalised texture  [OpenGL 4.5, §2.3.5.1, Eq. 2.2].
constexpr float decodedSnorm8(int8_t code) {
  const float value = static_cast<float>(code) / 127;
  return value < -1 ? -1 : value;
}
// Value of a byte of an unsigned normalised texture  [OpenGL 4.5, §2.3.5.1, Eq. 2.1].
constexpr float decodedUnorm8(uint8_t code) { return static_cast<float>(code) / 255; }

// Nearest code of a value; values outside -1..1 or 0..1 have that of the nearest bound, NaN that of 0.
int8_t snorm8Of(float value);
uint8_t unorm8Of(float value);

// Signed byte stored as an unsigned one, 128 for 0, as compressed textures need; and back.
constexpr uint8_t biased(int8_t code) { return static_cast<uint8_t>(code + 128); }
constexpr int8_t unbiased(uint8_t code) { return static_cast<int8_t>(code - 128); }

// Nearest byte of a value of a surface or view map; map_shape.h has the inverse.
uint8_t byteOf(Factorization method, float value);

// Largest absolute value; 0 for an empty map.
float scaleOf(std::span<const float> map);

// Codes of value / scale; all 0 if the scale is 0. With scaleOf(map) or a larger scale, the error of a
// decoded value is at most half a step, up to rounding: scale / 254 (signed) or scale / 510.
std::vector<int8_t> snorm8Of(std::span<const float> map, float scale);
std::vector<uint8_t> unorm8Of(std::span<const float> map, float scale);

// scale x decoded value of each code.
std::vector<float> decoded(std::span<const int8_t> codes, float scale);
std::vector<float> decoded(std::span<const uint8_t> codes, float scale);

// Light field maps as indices into codebooks.  [Chen 2002, §4]
struct MapCodebookOptions {
  CodebookStart start = CodebookStart::split;
  double ratio = 10;     // maps per codeword, at least 1; 0: no bound
  double distortion = 0; // mean squared error of a map's values that suffices; 0: no bound
  bool means = false;    // whether mean maps get a codebook, too
};

// Maps of coding `bytes` with a codebook for the surface maps, and one for the view maps, of each term.
// Surface maps take the scalar layout. There are about as few codewords as the bounds allow. Errors are
// weighted by the squares of the vertices' scales; users of scale 0 have no map afterwards. Throws Error if
// both bounds are 0, and Cancelled.
LightFieldMaps withCodebooks(const LightFieldMaps& maps, const MapCodebookOptions& options = {},
                             const Progress& progress = {});

} // namespace surflect::lfm
