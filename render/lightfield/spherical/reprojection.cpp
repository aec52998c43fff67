#include "render/lightfield/spherical/reprojection.h"

#include <algorithm>
#include <cmath>

namespace surflect::spherical {

namespace {

struct HeightAbove {
  double h, above;
};

// Zero of a function between a place where it is negative and one where it is not, by the Illinois method:
// false position that halves the value at an end which is kept twice.
template <class Above> double crossing(const Above& above, HeightAbove high, HeightAbove low) {
  int kept = 0; // how often in a row: the high end if positive, the low one if negative
  for (int i = 0; i < kRefinements && low.above > 0; ++i) {
    const double h = high.h + (low.h - high.h) * high.above / (high.above - low.above), value = above(h);
    if (value >= 0) {
      low = {h, value};
      kept = std::max(kept, 0) + 1;
      if (kept > 1) high.above /= 2;
    } else {
      high = {h, value};
      kept = std::min(kept, 0) - 1;
      if (kept < -1) low.above /= 2;
    }
  }
  return low.h;
}

} // namespace

Vec2<double> atPlane(const Vec3<double>& e, const Vec3<double>& w) {
  return e.head<2>() - e[2] / w[2] * w.head<2>();
}

Vec2<double> slopeOf(const Vec3<double>& e, const Vec2<double>& atPlane) {
  return (e.head<2>() - atPlane) / e[2];
}

bool passesSphere(const Vec3<double>& e, const Vec2<double>& atPlane, const Vec2<double>& slope) {
  const Vec2<double> offset = atPlane - Vec2<double>(0.5, 0.5);
  // Height at which the line is nearest to the middle of the sphere.
  const double nearest = -offset.dot(slope) / (1 + slope.squaredNorm());
  const bool isInside = (e - Vec3<double>(0.5, 0.5, 0)).squaredNorm() < 0.25;
  return (nearest < e[2] || isInside) && (offset + nearest * slope).squaredNorm() + nearest * nearest < 0.25;
}

March marchOf(const HeightRange& range, const Vec2<double>& slope, double viewer, int size, double mip) {
  constexpr double kMargin = 1.0 / 1024; // beyond the heights, so that rounding leaves none of them uncrossed
  March march{std::min(viewer, double{range.highest} + kMargin), double{range.lowest} - kMargin};
  const double texels = (march.from - march.to) * slope.norm() * size * std::exp2(-mip);
  march.steps = static_cast<int>(std::clamp(std::ceil(texels), 1.0, 0.0 + kMostSteps));
  return march;
}

std::optional<double> heightMet(const PencilImage& image, const Vec2<double>& atPlane,
                                const Vec2<double>& slope, double viewer, double mip) {
  const auto above = [&](double h) { return heightAt(image, atPlane + h * slope, mip) - h; };
  const March march = marchOf(image.range, slope, viewer, image.mips[0].size, mip);
  std::optional<double> met;
  if (march.from <= march.to) return met;
  double metAlpha = 0, high = march.from, highAbove = std::min(0.0, above(high));
  for (int i = 1; i <= march.steps; ++i) {
    const double low = march.from - (march.from - march.to) * i / march.steps, lowAbove = above(low);
    if (highAbove < 0 && lowAbove >= 0) {
      const double h = crossing(above, {high, highAbove}, {low, lowAbove});
      const double alpha = colorAt(image, atPlane + h * slope, mip)[3];
      if (alpha > metAlpha) met = h, metAlpha = alpha;
      if (alpha >= kSolid) break;
    }
    high = low, highAbove = lowAbove;
  }
  return met;
}

double mipFor(const Sphere& sphere, int size, double distance, double pixel) {
  const double texel = 2 * sphere.radius / size;
  return std::max(0.0, std::log2(distance * pixel / texel));
}

} // namespace surflect::spherical
