#include "warp/skeleton.h"

#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

namespace surflect::warp {
namespace {

Eigen::Vector4d randomQuaternion(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector4d(normal(random), normal(random), normal(random), normal(random)).normalized();
}

Channel channelOf(Channel::Property property, Interpolation interpolation, std::vector<double> seconds,
                  std::vector<double> values) {
  return {0, property, interpolation, std::move(seconds), std::move(values)};
}

constexpr auto translation = Channel::Property::translation;
constexpr auto rotation = Channel::Property::rotation;

TEST(Sample, StepHoldsAndLinearGoesStraightBetweenKeysAndEndsStay) {
  const std::vector<double> seconds = {1, 2, 4}, values = {1, 2, 3, 3, 2, 1, 0, 0, 8};
  const Channel step = channelOf(translation, Interpolation::step, seconds, values);
  const Channel linear = channelOf(translation, Interpolation::linear, seconds, values);
  const auto at = [](const Channel& channel, double t) { return Vec3<double>(sample(channel, t).head<3>()); };
  for (const Channel& channel : {step, linear}) {
    for (const double t : {-5., 0., 1.}) EXPECT_EQ(at(channel, t), Vec3<double>(1, 2, 3));
    for (const double t : {4., 5., 1e9}) EXPECT_EQ(at(channel, t), Vec3<double>(0, 0, 8));
    EXPECT_EQ(at(channel, 2), Vec3<double>(3, 2, 1));
  }
  EXPECT_EQ(at(step, 3.999), Vec3<double>(3, 2, 1));
  EXPECT_EQ(at(linear, 1.5), Vec3<double>(2, 2, 2));
  EXPECT_EQ(at(linear, 3.5), Vec3<double>(0.75, 0.5, 6.25));
}

TEST(Sample, LinearRotationsTurnEvenlyTheShorterWay) {
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector4d p = randomQuaternion(random), q = randomQuaternion(random);
    const Channel channel =
        channelOf(rotation, Interpolation::linear, {0, 1}, {p[0], p[1], p[2], p[3], q[0], q[1], q[2], q[3]});
    const double x = randomBetween(0, 1, random);
    const Eigen::Quaterniond from(p), to(q), at(Eigen::Vector4d(sample(channel, x)));
    const double whole = from.angularDistance(to);
    EXPECT_NEAR(from.angularDistance(at), x * whole, 1e-7);
    EXPECT_NEAR(at.angularDistance(to), (1 - x) * whole, 1e-7);
  }
  // Also where both are nearly the same.
  const Channel still = channelOf(rotation, Interpolation::linear, {0, 1}, {0, 0, 0, 1, 1e-9, 0, 0, -1});
  EXPECT_LT((sample(still, 0.5) - Eigen::Vector4d(0, 0, 0, 1)).norm(), 1e-9);
}

TEST(Sample, ACubicSplineWithACubicsDerivativesIsTheCubic) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> a = randomVector(random), b = randomVector(random), c = randomVector(random),
                       d = randomVector(random);
    const auto cubic = [&](double t) { return Vec3<double>(a + t * (b + t * (c + t * d))); };
    const auto slope = [&](double t) { return Vec3<double>(b + t * (2 * c + 3 * t * d)); };
    const std::vector<double> seconds = {-1, 0.5, 1.7};
    std::vector<double> values;
    for (const double t : seconds)
      for (const Vec3<double>& v : {slope(t), cubic(t), slope(t)})
        values.insert(values.end(), v.begin(), v.end());
    const Channel channel = channelOf(translation, Interpolation::cubicSpline, seconds, values);
    for (const double t : {-1., -0.3, 0.5, 0.9, 1.6, 1.7})
      EXPECT_LT((sample(channel, t).head<3>() - cubic(t)).norm(), 1e-14);
    EXPECT_EQ(Vec3<double>(sample(channel, 9).head<3>()), cubic(1.7));
  }
}

TEST(Sample, CubicRotationsAreUnit) {
  std::mt19937 random(3);
  std::vector<double> values;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector4d q = randomQuaternion(random);
    values.insert(values.end(), q.begin(), q.end());
  }
  const Channel channel = channelOf(rotation, Interpolation::cubicSpline, {0, 1}, values);
  for (double t = 0; t <= 1; t += 0.1) EXPECT_NEAR(sample(channel, t).norm(), 1, 1e-15);
}

// A chain of random nodes, not in order, each but the first with a parent; the skin has random weights.
Skeleton randomSkeleton(std::mt19937& random) {
  Skeleton skeleton;
  skeleton.nodes.resize(6);
  skeleton.order = {3, 1, 0, 5, 2, 4};
  for (size_t k = 0; k < 6; ++k) {
    SkeletonNode& node = skeleton.nodes[skeleton.order[k]];
    if (k > 0) node.parent = skeleton.order[random() % k];
    node.translation = randomVector(random);
    node.rotation.coeffs() = randomQuaternion(random);
    node.scale = Vec3<double>(1, 1, 1) + 0.5 * randomVector(random);
    if (k == 2) {
      node.fixed.emplace();
      for (int c = 0; c < 3; ++c) node.fixed->linear.col(c) = randomVector(random);
    }
  }
  for (const uint32_t node : {0u, 2u, 4u}) {
    SkinJoint joint{node, {}};
    for (int c = 0; c < 3; ++c) joint.inverseBind.linear.col(c) = randomVector(random);
    joint.inverseBind.offset = randomVector(random);
    skeleton.joints.push_back(joint);
  }
  skeleton.firstInfluence.push_back(0);
  for (int i = 0; i < 5; ++i) {
    skeleton.vertices.push_back(randomVector(random));
    const double share = randomBetween(0, 1, random);
    skeleton.influences.push_back({static_cast<uint32_t>(random() % 3), share});
    skeleton.influences.push_back({static_cast<uint32_t>(random() % 3), 1 - share});
    skeleton.firstInfluence.push_back(static_cast<uint32_t>(skeleton.influences.size()));
  }
  return skeleton;
}

using Matrix4 = Eigen::Matrix4d;

Matrix4 matrixOf(const AffineMap& map) {
  Matrix4 m = Matrix4::Identity();
  m.topLeftCorner<3, 3>() = map.linear;
  m.topRightCorner<3, 1>() = map.offset;
  return m;
}

// T R S as matrices, up the chain of parents.
Matrix4 globalOf(const std::vector<SkeletonNode>& nodes, uint32_t i) {
  const SkeletonNode& node = nodes[i];
  const Matrix4 local =
      node.fixed
          ? matrixOf(*node.fixed)
          : Matrix4((Eigen::Translation3d(node.translation) * node.rotation * Eigen::Scaling(node.scale))
                        .matrix());
  return node.parent ? Matrix4(globalOf(nodes, *node.parent) * local) : local;
}

// [glTF, §3.7.3.2], with 4x4 matrices.
TEST(Pose, IsTheWeightedSumOfTheJointsMatrices) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 100; ++trial) {
    const Skeleton skeleton = randomSkeleton(random);
    const Eigen::Vector4d q = randomQuaternion(random);
    Channel turn = channelOf(rotation, Interpolation::step, {0}, {q[0], q[1], q[2], q[3]});
    turn.node = 5;
    Channel stretch = channelOf(Channel::Property::scale, Interpolation::step, {0}, {2, 3, 4});
    stretch.node = 3;
    Channel move = channelOf(translation, Interpolation::linear, {0, 2}, {0, 0, 0, 2, 4, 6});
    move.node = 3;
    std::vector<SkeletonNode> nodes = skeleton.nodes;
    if (nodes[5].fixed || nodes[3].fixed) continue;
    nodes[5].rotation.coeffs() = q;
    nodes[3].scale = {2, 3, 4};
    nodes[3].translation = {1, 2, 3};
    const auto posed = pose(skeleton, std::array{turn, stretch, move}, 1);
    for (size_t i = 0; i < skeleton.vertices.size(); ++i) {
      Matrix4 sum = Matrix4::Zero();
      for (uint32_t k = skeleton.firstInfluence[i]; k < skeleton.firstInfluence[i + 1]; ++k) {
        const auto [joint, weight] = skeleton.influences[k];
        sum += weight * globalOf(nodes, skeleton.joints[joint].node) *
               matrixOf(skeleton.joints[joint].inverseBind);
      }
      const Vec3<double> expected = (sum * skeleton.vertices[i].homogeneous()).head<3>();
      EXPECT_LT((posed[i] - expected).norm(), 1e-13 * (1 + expected.norm()));
    }
  }
}

} // namespace
} // namespace surflect::warp
