// Gaussians over time as an OpenUSD text file (.usda): a ParticleField with the Gaussian surflet kernel.
//
// [UsdVol] OpenUSD, pxr/usd/usdVol/schema.usda: ParticleField and its applied schemas. Scales and opacities
//          are linear, quaternions (w, x, y, z); the kernel is a disc in the Gaussian's xy plane, with
//          standard deviation 1 before it is scaled; each particle has its own row of coefficients, the
//          constant first.
//
// The schema leaves open what the harmonics add up to. As its other writers do, this one follows 3D Gaussian
// splatting: colour = 1/2 + sum_j c_j Y_j, sRGB-encoded (gaussian_ply.h).
#pragma once

#include "render/gaussians/gaussians.h"
#include "surfel/base/time.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace surflect::gaussians {

struct ParticleFieldFrames {
  std::vector<int> frames; // time codes, ascending; not empty
  double framesPerSecond = 24;
  size_t drawn = 0;    // particles of every frame: surfels that are dead in a frame have scale 0
  bool isZUp = false;  // else y is up
  std::string comment; // one line
};

// Gaussians of the k-th frame.
using GaussiansAt = std::function<std::shared_ptr<const Gaussians>(size_t k)>;

// Bytes of a file, about.
uint64_t particleFieldBytes(const ParticleFieldFrames& frames, int degree);

// Writes a file atomically. Several frames are time samples, of which one is in memory at a time: each
// attribute is a pass over all frames. A particle has the opacity of the first frame in which it lives, and
// in each frame the axes nearest to those of the frame before. Throws Error and Cancelled, and Error if no
// particle lives in any frame.
void writeParticleField(const std::filesystem::path& path, const ParticleFieldFrames& frames,
                        const GaussiansAt& at, int degree, const Progress& progress = {});

} // namespace surflect::gaussians
