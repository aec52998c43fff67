#include "bench/doll/doll_blocks.h"

#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"
#include "surfel/math/sphere_sampling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

namespace surflect::bench {

namespace {

constexpr size_t kNormals = 128, kVariants = 4;
constexpr uint64_t kAllTexels = ~uint64_t{0};

// Radiance, in one channel, of rough cloth with a glossy lobe around the normal; lights behind the surface
// contribute scattered light.
double reflected(double cosine, double albedo, double gloss) {
  if (cosine <= 0) return 0.01 * albedo;
  return albedo * cosine + gloss * std::pow(cosine, 60);
}

} // namespace

Eigen::MatrixXf dollPatch(const Vec3<double>& normal, std::span<const capture::Light> lights, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform;
  const Vec3<double> albedo(0.2 + 0.6 * uniform(random), 0.2 + 0.6 * uniform(random),
                            0.2 + 0.6 * uniform(random));
  const Vec3<double> print(uniform(random), uniform(random), uniform(random));
  const double gloss = 0.6 * uniform(random), phase = 6.28 * uniform(random), pitch = 0.5 + uniform(random);
  const Vec3<double> right = normal.unitOrthogonal(), up = normal.cross(right);
  constexpr double kTurn = 0.006, kBump = 0.03; // radians per pixel; amplitude of the weave
  constexpr double kNoise = 0.01;               // photon noise at white, relative to white
  Eigen::MatrixXf radiance(3 * codec::blockTexels, lights.size());
  for (int texel = 0; texel < codec::blockTexels; ++texel) {
    const double x = texel % codec::blockSize - 3.5, y = texel / codec::blockSize - 3.5;
    const Vec3<double> bump(gauss(random), gauss(random), gauss(random));
    const Vec3<double> n = (normal + kTurn * (x * right + y * up) + kBump * bump).normalized();
    const double stripe = 0.5 + 0.5 * std::sin(pitch * (x + 0.4 * y) + phase);
    for (size_t light = 0; light < lights.size(); ++light) {
      const auto towards = std::get<capture::DirectionalLight>(lights[light].kind).towards.raw();
      for (int channel = 0; channel < 3; ++channel) {
        const double colour = albedo[channel] * (1 - 0.5 * stripe) + 0.5 * stripe * print[channel];
        const double value = reflected(n.dot(towards), colour, gloss);
        radiance(3 * texel + channel, static_cast<Eigen::Index>(light)) =
            static_cast<float>(value + kNoise * std::sqrt(value) * gauss(random));
      }
    }
  }
  return radiance;
}

DollBlocks::DollBlocks(std::span<const capture::Light> lights, uint64_t seed)
    : normals_(fibonacciSphere(kNormals)), patches_(kNormals * kVariants) {
  tbb::parallel_for(size_t{0}, patches_.size(), [&](size_t i) {
    auto& [radiance, record] = patches_[i];
    radiance = dollPatch(normals_[i / kVariants], lights, seed * patches_.size() + i);
    record = codec::encodeBlock(kAllTexels, radiance, kTolerance, kWhite).record;
  });
}

std::vector<std::byte> DollBlocks::record(const Vec3<double>& normal, uint64_t variant,
                                          uint64_t present) const {
  const auto nearest = std::ranges::max_element(normals_, {}, [&](const auto& n) { return n.dot(normal); });
  const auto& [radiance, record] =
      patches_[static_cast<size_t>(nearest - normals_.begin()) * kVariants + variant % kVariants];
  if (present == kAllTexels) return record;
  Eigen::MatrixXf part(3 * std::popcount(present), radiance.cols());
  for (int texel = 0, row = 0; texel < codec::blockTexels; ++texel)
    if (present >> texel & 1) {
      part.middleRows(row, 3) = radiance.middleRows(3 * texel, 3);
      row += 3;
    }
  return codec::encodeBlock(present, part, kTolerance, kWhite).record;
}

} // namespace surflect::bench
