#include "warp/skeleton.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::warp {

namespace {

// Value `index` of a channel's keys: 3 or 4 numbers, the others 0.
Eigen::Vector4d keyed(const Channel& channel, size_t index) {
  const int size = channel.property == Channel::Property::rotation ? 4 : 3;
  Eigen::Vector4d value = Eigen::Vector4d::Zero();
  for (int i = 0; i < size; ++i) value[i] = channel.values[index * size + i];
  return value;
}

// Slerp: a = acos |p . q|, (sin(a (1 - x)) p + sign(p . q) sin(a x) q) / sin a
Eigen::Vector4d slerp(const Eigen::Vector4d& p, const Eigen::Vector4d& q, double x) {
  const double cosine = p.dot(q), sign = cosine < 0 ? -1 : 1;
  const double a = std::acos(std::min(1.0, std::abs(cosine)));
  if (a < 1e-6) return (1 - x) * p + x * sign * q;
  return (std::sin(a * (1 - x)) * p + sign * std::sin(a * x) * q) / std::sin(a);
}

// Hermite spline, with d the time between the keys, v their values, b the out-tangent of the first, a the
// in-tangent of the second:
//   (2x^3 - 3x^2 + 1) v0 + d (x^3 - 2x^2 + x) b0 + (-2x^3 + 3x^2) v1 + d (x^3 - x^2) a1
Eigen::Vector4d hermite(const Channel& channel, size_t key, double d, double x) {
  const Eigen::Vector4d v0 = keyed(channel, 3 * key + 1), b0 = keyed(channel, 3 * key + 2),
                        a1 = keyed(channel, 3 * key + 3), v1 = keyed(channel, 3 * key + 4);
  const double x2 = x * x, x3 = x2 * x;
  return (2 * x3 - 3 * x2 + 1) * v0 + d * (x3 - 2 * x2 + x) * b0 + (3 * x2 - 2 * x3) * v1 +
         d * (x3 - x2) * a1;
}

Eigen::Vector4d interpolated(const Channel& channel, double seconds) {
  const bool cubic = channel.interpolation == Interpolation::cubicSpline;
  const auto value = [&](size_t key) { return keyed(channel, cubic ? 3 * key + 1 : key); };
  const std::vector<double>& times = channel.seconds;
  const size_t next = static_cast<size_t>(std::ranges::upper_bound(times, seconds) - times.begin());
  if (next == 0) return value(0);
  if (next == times.size()) return value(next - 1);
  if (channel.interpolation == Interpolation::step) return value(next - 1);
  const double d = times[next] - times[next - 1], x = (seconds - times[next - 1]) / d;
  if (cubic) return hermite(channel, next - 1, d, x);
  if (channel.property == Channel::Property::rotation) return slerp(value(next - 1), value(next), x);
  return (1 - x) * value(next - 1) + x * value(next);
}

AffineMap localOf(const SkeletonNode& node) {
  if (node.fixed) return *node.fixed;
  return {node.rotation.toRotationMatrix() * node.scale.asDiagonal(), node.translation};
}

} // namespace

AffineMap operator*(const AffineMap& outer, const AffineMap& inner) {
  return {outer.linear * inner.linear, outer(inner.offset)};
}

Eigen::Vector4d sample(const Channel& channel, double seconds) {
  assert(!channel.seconds.empty());
  const Eigen::Vector4d value = interpolated(channel, seconds);
  return channel.property == Channel::Property::rotation ? value.stableNormalized() : value;
}

std::vector<AffineMap> globalsOf(const std::vector<SkeletonNode>& nodes,
                                 std::span<const uint32_t> parentsFirst) {
  std::vector<AffineMap> global(nodes.size());
  for (const uint32_t i : parentsFirst)
    global[i] = nodes[i].parent ? global[*nodes[i].parent] * localOf(nodes[i]) : localOf(nodes[i]);
  return global;
}

std::vector<Vec3<double>> pose(const Skeleton& skeleton, std::span<const Channel> channels, double seconds) {
  std::vector<SkeletonNode> nodes = skeleton.nodes;
  for (const Channel& channel : channels) {
    const Eigen::Vector4d value = sample(channel, seconds);
    SkeletonNode& node = nodes[channel.node];
    assert(!node.fixed);
    if (channel.property == Channel::Property::translation) node.translation = value.head<3>();
    if (channel.property == Channel::Property::scale) node.scale = value.head<3>();
    if (channel.property == Channel::Property::rotation) node.rotation.coeffs() = value;
  }
  const std::vector<AffineMap> global = globalsOf(nodes, skeleton.order);

  std::vector<AffineMap> ofJoint;
  for (const SkinJoint& joint : skeleton.joints) ofJoint.push_back(global[joint.node] * joint.inverseBind);
  std::vector<Vec3<double>> posed;
  for (size_t i = 0; i < skeleton.vertices.size(); ++i) {
    Vec3<double> p = Vec3<double>::Zero();
    for (uint32_t k = skeleton.firstInfluence[i]; k < skeleton.firstInfluence[i + 1]; ++k)
      p += skeleton.influences[k].weight * ofJoint[skeleton.influences[k].joint](skeleton.vertices[i]);
    posed.push_back(p);
  }
  return posed;
}

} // namespace surflect::warp
