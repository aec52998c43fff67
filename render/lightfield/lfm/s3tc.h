// S3TC: blocks of 4 x 4 texels of a texture, which graphics hardware decodes as it reads them.
//
// [EXT_texture_compression_s3tc] the OpenGL extension. DXT1 takes 8 bytes a block: two colours of 5, 6 and 5
// bits, and for each texel one of four mixtures of them. DXT5 takes 16: eight more for alpha, interpolated in
// the same way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

enum class S3tcFormat { dxt1, dxt5 };

enum class S3tcEffort {
  range,  // the ends of the principal axis of a block's colours
  cluster // the best of all partitions along that axis; about twenty times slower
};

constexpr size_t bytesOfBlock(S3tcFormat format) { return format == S3tcFormat::dxt1 ? 8 : 16; }

// Blocks of width x height RGBA texels, row by row; both must be multiples of 4. DXT1 takes all texels as
// opaque.
std::vector<uint8_t> s3tcBlocks(std::span<const uint8_t> rgba, size_t width, size_t height,
                                S3tcFormat format = S3tcFormat::dxt1,
                                S3tcEffort effort = S3tcEffort::cluster);

// RGBA texels of blocks, as the extension defines them, each rounded to the nearest byte.
std::vector<uint8_t> s3tcTexels(std::span<const uint8_t> blocks, size_t width, size_t height,
                                S3tcFormat format = S3tcFormat::dxt1);

} // namespace surflect::lfm
