#include "render/lightfield/common/edge_distance.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace surflect::lightfield {

namespace {

// Tangent of 72 degrees, where views fade because the surface is seen at a grazing angle.
constexpr double kSteep = 3;

// Distance along a ray to the tangent plane at a hit; not finite if the ray does not meet it.
double distanceToPlane(const PixelHit& hit, const PixelHit& ray) {
  const Vec3<double> point = hit.origin.raw() + hit.distance * hit.direction.raw();
  return hit.normal.dot(point - ray.origin.raw()) / hit.normal.dot(ray.direction.raw());
}

// Distance between the ray of a and that of b where a meets the surface.
double spacing(const PixelHit& a, const PixelHit& b) {
  return (a.origin.raw() + a.distance * a.direction.raw() - b.origin.raw() - a.distance * b.direction.raw())
      .norm();
}

// Does a plane of this slope explain the step from one pixel to the next? Not for slopes that are not finite.
bool predicts(double slope, double step) { return std::abs(step - slope) <= 1 + 0.5 * std::abs(slope); }

} // namespace

bool isContinuous(const PixelHit& a, const PixelHit& b) {
  if (!a.isSurface() || !b.isSurface()) return false;
  const double h = std::min(spacing(a, b), spacing(b, a));
  const double step = (b.distance - a.distance) / h;
  const double slopeA = (distanceToPlane(a, b) - a.distance) / h,
               slopeB = (b.distance - distanceToPlane(b, a)) / h;
  if (!std::isfinite(slopeA) || !std::isfinite(slopeB)) return false;
  if (predicts(slopeA, step) || predicts(slopeB, step)) return true;
  const auto [low, high] = std::minmax(slopeA, slopeB);
  return step >= std::max(low, -kSteep) && step <= std::min(high, kSteep);
}

std::vector<uint8_t> edgeDistances(std::span<const PixelHit> hits, int width) {
  assert(width > 0 && hits.size() % static_cast<size_t>(width) == 0);
  const int height = static_cast<int>(hits.size()) / width;
  const auto indexOf = [width](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  };
  std::vector<uint8_t> isEdge(hits.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const auto& [dx, dy] : {std::array{1, 0}, {-1, 1}, {0, 1}, {1, 1}}) {
        if (x + dx < 0 || x + dx >= width || y + dy >= height) continue;
        const size_t a = indexOf(x, y), b = indexOf(x + dx, y + dy);
        if (!isContinuous(hits[a], hits[b])) isEdge[a] = isEdge[b] = 1;
      }
  constexpr int kReach = kFarFromEdges - 1;
  std::vector<uint8_t> distances(hits.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!hits[indexOf(x, y)].isSurface()) continue;
      int least = kReach * kReach; // squared
      for (int j = std::max(0, y - kReach); j <= std::min(height - 1, y + kReach); ++j)
        for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i)
          if (isEdge[indexOf(i, j)]) least = std::min(least, (i - x) * (i - x) + (j - y) * (j - y));
      distances[indexOf(x, y)] =
          static_cast<uint8_t>(std::lround(kCodesPerPixel * (1 + std::sqrt(static_cast<double>(least)))));
    }
  return distances;
}

} // namespace surflect::lightfield
