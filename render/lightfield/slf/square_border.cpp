#include "render/lightfield/slf/square_border.h"

#include <cassert>

namespace surflect::slf {

namespace {

// Point of the lower side at 0..1 of its length: a parabola through the corners that touches y = 0.
Vec2<double> lowerSide(double along, double bulge) {
  const double x = bulge + (1 - 2 * bulge) * along;
  const double fromMiddle = 2 * along - 1;
  return {x, bulge * fromMiddle * fromMiddle};
}

// Turned by quarters of a turn about the middle of the square.
Vec2<double> quarterTurns(Vec2<double> p, size_t quarters) {
  for (size_t i = 0; i < quarters; ++i) p = Vec2<double>(1 - p.y(), p.x());
  return p;
}

} // namespace

std::vector<Vec2<double>> squareBorder(const Disc& disc, const SquareCorners& corners,
                                       const SquareShape& shape) {
  const size_t n = disc.border.size();
  assert(n >= 4 && corners[0] < corners[1] && corners[1] < corners[2] && corners[2] < corners[3] &&
         corners[3] < n);
  assert(shape.bulge > 0 && shape.bulge < 1.0 / 6);
  const auto positionOf = [&](size_t i) -> const Vec3<double>& { return disc.positions[disc.border[i % n]]; };
  std::vector<Vec2<double>> result(n);
  for (size_t side = 0; side < 4; ++side) {
    const size_t first = corners[side], count = side < 3 ? corners[side + 1] - first : corners[0] + n - first;
    std::vector<double> reached(count + 1, 0);
    for (size_t i = 0; i < count; ++i)
      reached[i + 1] = reached[i] + (positionOf(first + i + 1) - positionOf(first + i)).norm();
    for (size_t i = 0; i < count; ++i) {
      const double even = static_cast<double>(i) / static_cast<double>(count);
      const double byLength = reached[count] > 0 ? reached[i] / reached[count] : even;
      const double along = byLength + shape.evenness * (even - byLength);
      result[(first + i) % n] = quarterTurns(lowerSide(along, shape.bulge), side);
    }
  }
  return result;
}

} // namespace surflect::slf
