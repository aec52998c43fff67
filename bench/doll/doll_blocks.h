// Blocks of reflectance for a doll of any number of views, from a few hundred that the encoder has made.
//
// A block is chosen by the normal of the surface that it shows and loses the texels that are background.
// Ranks, precisions and sizes are therefore those of encodeBlock on a curved, textured, glossy and noisy
// surface under the rig's lights; a neighbour's texture does not continue, which no look-up notices.
#pragma once

#include "srf/capture/rig.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::bench {

// What a camera records of 8x8 texels of printed, glossy cloth whose middle has this normal, under
// directional lights; colours, weave and noise are those of the seed. [texel and channel][light]
Eigen::MatrixXf dollPatch(const Vec3<double>& normal, std::span<const capture::Light> lights, uint64_t seed);

// The record of the same block with the texels of `present` alone (bits as in encodeBlock, not 0): rows of
// eigenimages are dropped, and where fewer rows than terms are left the last terms. `record` holds all
// texels.
std::vector<std::byte> withTexels(std::span<const std::byte> record, size_t lights, uint64_t present);

class DollBlocks {
public:
  static constexpr float kTolerance = 0.03f, kWhite = 1;

  // Encodes them. The same seed gives the same blocks, for any number of threads.
  DollBlocks(std::span<const capture::Light> lights, uint64_t seed);

  // A record that shows a surface of this normal at the `present` texels; which of the variants tells
  // `variant`.
  std::vector<std::byte> record(const Vec3<double>& normal, uint64_t variant, uint64_t present) const;

private:
  size_t lights_;
  std::vector<Vec3<double>> normals_;
  std::vector<std::vector<std::byte>> records_; // kVariants per normal
};

} // namespace surflect::bench
