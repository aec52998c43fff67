// Reflectance blocks for a doll of any number of views, encoded from a few hundred synthetic patches of
// cloth. A block is chosen by the surface normal that it shows, and holds the texels that are not background.
// Ranks, precisions and sizes are those of encodeBlock on a curved, textured, glossy and noisy surface; the
// texture does not continue between neighbouring blocks.
#pragma once

#include "srf/capture/rig.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::bench {

// Radiance of 8x8 texels of printed, glossy cloth around a normal, under directional lights of irradiance 1.
// The seed determines colours, weave and noise. [texels x channels][lights]
Eigen::MatrixXf dollPatch(const Vec3<double>& normal, std::span<const capture::Light> lights, uint64_t seed);

class DollBlocks {
public:
  static constexpr float kTolerance = 0.03f, kWhite = 1;

  // Blocks depend on the seed only, not on the number of threads.
  DollBlocks(std::span<const capture::Light> lights, uint64_t seed);

  // Record of a block for the patch whose normal is nearest to `normal`; `variant` chooses among the patches
  // of that normal. Contains the texels `present` (as in encodeBlock).
  std::vector<std::byte> record(const Vec3<double>& normal, uint64_t variant, uint64_t present) const;

private:
  struct Patch {
    Eigen::MatrixXf radiance;
    std::vector<std::byte> record; // with all texels present
  };
  std::vector<Vec3<double>> normals_;
  std::vector<Patch> patches_; // kVariants per normal
};

} // namespace surflect::bench
