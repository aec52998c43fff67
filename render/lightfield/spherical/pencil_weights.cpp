#include "render/lightfield/spherical/pencil_weights.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::spherical {

namespace {

// Other pencil at a side.
uint32_t acrossSide(const DirectionTree& tree, const Pencil& pencil, uint32_t a, uint32_t b) {
  const auto atB = tree.around(pencil.level, b);
  for (const uint32_t other : tree.around(pencil.level, a))
    if (other != pencil.index && std::ranges::find(atB, other) != atB.end()) return other;
  assert(false);
  return pencil.index;
}

// One of the six triangles of a pencil.
struct Part {
  Corners corners;     // middle, corner, middle of a side
  uint32_t corner = 0; // vertex
  uint32_t across = 0; // pencil at that side
};
std::array<Part, 6> partsOf(const DirectionTree& tree, const Pencil& pencil) {
  const auto& vertices = tree.vertices(pencil);
  const Corners corners = tree.corners(pencil);
  const Vec3<double> middle = tree.middle(pencil);
  std::array<Part, 6> parts;
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    const Vec3<double> side = (corners[i] + corners[j]).normalized();
    const uint32_t across = acrossSide(tree, pencil, vertices[i], vertices[j]);
    parts[2 * i] = {{middle, corners[i], side}, vertices[i], across};
    parts[2 * i + 1] = {{middle, corners[j], side}, vertices[j], across};
  }
  return parts;
}

// Weights at the corners of a part of `pencil` of one of the pencils that meet at the part's corner.
std::array<double, 3> weightsIn(const Part& part, const Pencil& pencil, uint32_t shown, size_t meeting) {
  const bool isOwn = shown == pencil.index, isAtSide = isOwn || shown == part.across;
  return {isOwn ? 1.0 : 0.0, 1.0 / static_cast<double>(meeting), isAtSide ? 0.5 : 0.0};
}

} // namespace

std::vector<LevelShare> levelShares(double detail, size_t levels) {
  const double clamped = std::clamp(detail, 0.0, static_cast<double>(levels - 1));
  const double coarse = std::floor(clamped), f = clamped - coarse;
  std::vector<LevelShare> shares{{static_cast<size_t>(coarse), 1 - f}};
  if (f > 0) shares.push_back({static_cast<size_t>(coarse) + 1, f});
  return shares;
}

std::vector<PencilShare> pencilShares(const DirectionTree& tree, size_t level, const Vec3<double>& direction,
                                      bool interpolated) {
  const Pencil pencil = tree.find(level, direction);
  if (!interpolated) return {{pencil, 1}};
  // The part that holds the direction: all x_i >= 0, up to rounding.
  const std::array<Part, 6> parts = partsOf(tree, pencil);
  const Part* holding = nullptr;
  Vec3<double> x = Vec3<double>::Zero();
  double best = -std::numeric_limits<double>::infinity();
  for (const Part& part : parts) {
    Mat3<double> corners;
    corners << part.corners[0], part.corners[1], part.corners[2];
    const Vec3<double> solved = corners.inverse() * direction;
    if (solved.minCoeff() > best) best = solved.minCoeff(), holding = &part, x = solved / solved.sum();
  }
  std::vector<PencilShare> shares;
  const auto meeting = tree.around(level, holding->corner);
  for (const uint32_t shown : meeting) {
    const auto weights = weightsIn(*holding, pencil, shown, meeting.size());
    shares.push_back({{pencil.level, shown}, x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2]});
  }
  return shares;
}

void appendTriangles(const DirectionTree& tree, const Pencil& pencil, double weight, bool interpolated,
                     std::vector<WeightedTriangle>& triangles) {
  if (!interpolated) {
    triangles.push_back({pencil, tree.corners(pencil), {weight, weight, weight}});
    return;
  }
  for (const Part& part : partsOf(tree, pencil)) {
    const auto meeting = tree.around(pencil.level, part.corner);
    for (const uint32_t shown : meeting) {
      auto weights = weightsIn(part, pencil, shown, meeting.size());
      for (double& w : weights) w *= weight;
      triangles.push_back({{pencil.level, shown}, part.corners, weights});
    }
  }
}

} // namespace surflect::spherical
