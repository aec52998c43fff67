// Corrections of maps on the edges of triangles. Codebooks and S3TC approximate each triangle by itself, so
// that triangles that share an edge have different values on it. On the edge the mean of these values counts.
// The difference to a triangle's own values fades beside the edge, so that no step shows there either.
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::lfm {

inline constexpr double kFadeSteps = 3; // samples beside an edge beyond which nothing is corrected

// Corrections, in steps of a byte. Side 0 of a corner is the edge to the next corner, side 1 that to the one
// before. Step a is the sample a steps away from the corner on that edge.
struct EdgeCorrections {
  size_t samples = 0, terms = 0; // along an edge; of the maps
  std::vector<int8_t> surface;   // [triangles][terms][corners][steps][sides]; empty if all are 0
  std::vector<int8_t> mean;      // [triangles][corners][steps][4 channels] of side 0; empty if all are 0
  double surfaceUnit = 0, meanUnit = 0; // value of a byte's step
};

// Corrections to the mean of the values of all triangles at an edge, and at a vertex, rounded to a byte. If
// it is more than 127 steps away from one of them, the nearest value within 127 steps of all counts.
EdgeCorrections edgeCorrections(const LightFieldMaps& maps);

// Interpolation of values given on edges, which fades with the distance from the edge. b: barycentrics, not
// negative; n samples along an edge.

// Share at a barycentric coordinate, 0 on the edge.
inline double fade(double b, size_t n) {
  return std::max(0.0, 1 - b * static_cast<double>(n - 1) / kFadeSteps);
}

// Between the two edges at a corner, to the next corner and to the one before, whose values are given at
// equal distances from the corner.
inline double fromSides(const Vec3<double>& b, size_t corner, double next, double before, size_t n) {
  const double i = b[static_cast<Eigen::Index>((corner + 1) % 3)],
               j = b[static_cast<Eigen::Index>((corner + 2) % 3)];
  if (i + j == 0) return (next + before) / 2;
  return (i * fade(j, n) * next + j * fade(i, n) * before) / (i + j);
}

// Between all edges: valueOn(corner, s) is the value at the share s of the edge from a corner to the next
// one.
double fromEdges(const Vec3<double>& b, const auto& valueOn, size_t n) {
  double sum = 0, weights = 0;
  for (size_t corner = 0; corner < 3; ++corner) {
    const double i = b[static_cast<Eigen::Index>(corner)], j = b[static_cast<Eigen::Index>((corner + 1) % 3)],
                 opposite = b[static_cast<Eigen::Index>((corner + 2) % 3)];
    if (i == 1) return valueOn(corner, 0);
    if (i * j == 0) continue;
    sum += i * j * fade(opposite, n) * valueOn(corner, j / (i + j));
    weights += i * j;
  }
  return weights > 0 ? sum / weights : 0;
}

// Correction of the surface map of a corner at barycentrics b.
double surfaceCorrection(const EdgeCorrections& edges, size_t triangle, size_t term, size_t corner,
                         const Vec3<double>& b);
// Correction of a channel of the mean at barycentrics b, as a share of its byte 255.
double meanCorrection(const EdgeCorrections& edges, size_t triangle, size_t channel, const Vec3<double>& b);

} // namespace surflect::lfm
