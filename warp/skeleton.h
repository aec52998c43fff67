// Linear blend skinning and key-framed motion of joints.
//
// [glTF] Khronos Group: glTF 2.0 Specification. §3.7.3 skins, §3.11 and Appendix C animations.
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::warp {

// x -> linear x + offset
struct AffineMap {
  Mat3<double> linear = Mat3<double>::Identity();
  Vec3<double> offset = Vec3<double>::Zero();

  Vec3<double> operator()(const Vec3<double>& x) const { return linear * x + offset; }
};
AffineMap operator*(const AffineMap& outer, const AffineMap& inner);

// A node scales, then rotates, then translates; a `fixed` one has a matrix instead.
struct SkeletonNode {
  std::optional<uint32_t> parent;
  Vec3<double> translation = Vec3<double>::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Vec3<double> scale = Vec3<double>::Ones();
  std::optional<AffineMap> fixed;
};

struct SkinJoint {
  uint32_t node = 0;
  AffineMap inverseBind; // joint's space from the skin's
};

struct Influence {
  uint32_t joint = 0;
  double weight = 0;
};

struct Skeleton {
  std::vector<SkeletonNode> nodes;
  std::vector<uint32_t> order; // all nodes, parents first
  std::vector<SkinJoint> joints;

  std::vector<Vec3<double>> vertices; // of the skin in bind pose
  std::vector<Influence>
      influences; // of vertex i: [firstInfluence[i], firstInfluence[i + 1]); weights sum to 1
  std::vector<uint32_t> firstInfluence;
  std::vector<std::array<uint32_t, 3>> triangles;
};

enum class Interpolation { step, linear, cubicSpline };

// One property of one node over time.
struct Channel {
  enum class Property { translation, rotation, scale };

  uint32_t node = 0;
  Property property{};
  Interpolation interpolation{};
  std::vector<double> seconds; // of the keys, increasing; at least one
  std::vector<double>
      values; // per key 3 or, for a rotation, x y z w; cubicSpline: in-tangent, value, out-tangent
};

// Property at a time: 3 numbers, or a unit quaternion x y z w. Constant before the first and after the last
// key. [glTF, Appendix C]
Eigen::Vector4d sample(const Channel& channel, double seconds);

// Global transform of each node without channels.
std::vector<AffineMap> globalsOf(const std::vector<SkeletonNode>& nodes,
                                 std::span<const uint32_t> parentsFirst);

// Vertices moved by the channels, in the nodes' world space:
//   p = sum of w_j G_j B_j v     [glTF, §3.7.3.2], G_j global transform and B_j inverse bind of joint j
std::vector<Vec3<double>> pose(const Skeleton& skeleton, std::span<const Channel> channels, double seconds);

} // namespace surflect::warp
