#include "render/lightfield/lfm/direction_disc.h"

#include <cmath>

namespace surflect::lfm {

namespace {

// Unit vector along a vector of the plane; the first axis if it is 0.
Vec2<double> azimuthOf(const Vec2<double>& v) {
  const double length = v.norm();
  return length > 0 ? Vec2<double>(v / length) : Vec2<double>(1, 0);
}

} // namespace

VertexFrame frameAlong(const Vec3<double>& normal) {
  const Vec3<double> z = normal.stableNormalized(), x = z.unitOrthogonal();
  return {x, z.cross(x), z};
}

DiscPoint discPoint(const VertexFrame& frame, const Direction& d) {
  Vec2<double> xy(d.raw().dot(frame.x), d.raw().dot(frame.y));
  if (d.raw().dot(frame.z) < 0) xy = azimuthOf(xy);
  return (xy + Vec2<double>(1, 1)) / 2;
}

Direction directionAt(const VertexFrame& frame, const DiscPoint& point) {
  Vec2<double> xy = 2 * point - Vec2<double>(1, 1);
  double z = 0;
  if (xy.squaredNorm() > 1)
    xy = azimuthOf(xy);
  else
    z = std::sqrt(1 - xy.squaredNorm());
  return assume<Direction>(xy[0] * frame.x + xy[1] * frame.y + z * frame.z);
}

} // namespace surflect::lfm
