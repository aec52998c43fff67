// S3TC: blocks of 4 x 4 texels of a texture, which graphics hardware decodes as it reads them.
//
// [EXT_texture_compression_s3tc] the OpenGL extension. DXT1 takes 8 bytes a block: two colours of 5, 6 and 5
// bits, and for each texel one of four mixtures of them. DXT5 has 8 bytes more: two alphas of 8 bits, and for
// each texel one of eight mixtures of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

enum class Blocks { dxt1, dxt5 };

inline constexpr int kBlockSide = 4; // texels
constexpr size_t blockBytes(Blocks blocks) { return blocks == Blocks::dxt5 ? 16 : 8; }

// Side of an image in texels, filled up to whole blocks.
constexpr int wholeBlocks(int texels) { return (texels + kBlockSide - 1) / kBlockSide * kBlockSide; }

// Weights of the texels when a block's two end colours are fitted: all alike, or their alpha.
enum class ColorFit { even, byAlpha };

// Blocks of width x height RGBA texels, row by row; both must be multiples of 4. DXT1 takes all texels as
// opaque.
std::vector<uint8_t> s3tcBlocks(std::span<const uint8_t> rgba, size_t width, size_t height,
                                Blocks kind = Blocks::dxt1, ColorFit fit = ColorFit::even);

// RGBA texels of blocks, as the extension defines them, each rounded to the nearest byte.
std::vector<uint8_t> s3tcTexels(std::span<const uint8_t> blocks, size_t width, size_t height,
                                Blocks kind = Blocks::dxt1);

// Texel 0..15 of one block, row by row.
std::array<uint8_t, 4> s3tcTexel(std::span<const uint8_t> block, size_t texel, Blocks kind);

} // namespace surflect::lfm
