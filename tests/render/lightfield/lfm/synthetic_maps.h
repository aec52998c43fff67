// Light field maps of random numbers, which agree on edges as those of rings do.
#pragma once

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/rings.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace surflect::lfm::testing {

using slf::testing::bumpySphere;
using slf::testing::squarePatch;

struct SyntheticOptions {
  Factorization method = Factorization::pca;
  int samples = 6, viewSize = 8;
  size_t terms = 3;
  unsigned seed = 1;
  size_t channels = 3;
};

// Frames along area-weighted normals.
inline std::vector<VertexFrame> framesOf(const TriangleMesh& mesh) {
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t]) normals[vertex] += areaVector(mesh, t);
  std::vector<VertexFrame> frames;
  for (const Vec3<double>& normal : normals) frames.push_back(frameAlong(normal));
  return frames;
}

// Finalizer of SplitMix64, which spreads the bits of a number.
inline uint64_t mixed(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

// Random number 0..1 of a surface point of a triangle: equal in all triangles that share the point.
inline double numberAt(const std::array<uint32_t, 3>& triangle, const std::array<int, 3>& steps,
                       unsigned seed) {
  uint64_t sum = seed; // over the corners, in whatever order
  for (size_t corner = 0; corner < 3; ++corner)
    if (steps[corner] > 0) sum += mixed(1000 * (uint64_t{1} + triangle[corner]) + unsigned(steps[corner]));
  return static_cast<double>(mixed(sum) >> 11) * 0x1p-53;
}

inline LightFieldMaps syntheticMaps(TriangleMesh mesh, const SyntheticOptions& options = {}) {
  std::vector<VertexFrame> frames = framesOf(mesh);
  LightFieldMaps maps = emptyMaps(std::move(mesh), std::move(frames), options.method, options.samples,
                                  options.viewSize, options.terms, options.channels);
  const bool isSigned = options.method == Factorization::pca;
  const PatchGrid grid(options.samples);
  // Byte of a number 0..1: of -1..1 if signed.
  const auto byteOf = [&](double number) {
    const double code = isSigned ? 127 * (2 * number - 1) : 255 * number;
    return static_cast<uint8_t>(static_cast<int>(std::lround(code)));
  };
  for (size_t t = 0; t < maps.mesh.triangles.size(); ++t)
    for (size_t sample = 0; sample < grid.samples(); ++sample) {
      const std::array<int, 3> steps = grid.steps(sample);
      const size_t at = 3 * (t * grid.samples() + sample);
      for (size_t corner = 0; corner < 3; ++corner) {
        const auto numberOf = [&](size_t k) {
          const uint32_t vertex = maps.mesh.triangles[t][corner];
          return numberAt(maps.mesh.triangles[t], steps,
                          options.seed + 1000 * static_cast<unsigned>(k) + 7919 * vertex);
        };
        for (size_t k = 0; k < options.terms; ++k)
          maps.terms[k].surface.maps.data[at + corner] = byteOf(numberOf(k));
      }
      for (size_t c = 0; c < options.channels && isSigned; ++c)
        maps.mean.maps.data[options.channels * (t * grid.samples() + sample) + c] =
            meanByte(0.6 + 0.4 * numberAt(maps.mesh.triangles[t], steps, options.seed + 31 + unsigned(c)), 1);
    }
  // Beyond the last samples that count, a surface map goes on.
  for (size_t t = 0; t < maps.mesh.triangles.size(); ++t)
    for (size_t sample = 0; sample < grid.samples(); ++sample)
      for (size_t corner = 0; corner < 3; ++corner)
        for (Term& term : maps.terms)
          if (grid.steps(sample)[corner] == 0)
            term.surface.maps.data[3 * (t * grid.samples() + sample) + corner] =
                term.surface.maps
                    .data[3 * (t * grid.samples() + grid.besideFarEdge(sample, corner)) + corner];
  std::mt19937 random(options.seed);
  std::uniform_real_distribution<double> number(0, 1);
  for (size_t k = 0; k < options.terms; ++k) {
    for (uint8_t& byte : maps.terms[k].view.maps.data) byte = byteOf(number(random));
    for (float& scale : maps.terms[k].scale)
      scale = static_cast<float>(number(random)) / static_cast<float>(1 + k);
  }
  maps.meanWhite = 1.4f;
  return maps;
}

} // namespace surflect::lfm::testing
