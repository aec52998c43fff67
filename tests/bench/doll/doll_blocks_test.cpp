#include "bench/doll/doll_blocks.h"

#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"
#include "surfel/math/sphere_sampling.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::bench {
namespace {

std::vector<capture::Light> lightsAround(size_t count) {
  std::vector<capture::Light> lights;
  for (const auto& towards : fibonacciSphere(count))
    lights.push_back(
        {"", "",
         capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}}});
  return lights;
}

TEST(DollBlocks, HoldTheTexelsThatArePresent) {
  const auto lights = lightsAround(7);
  const DollBlocks blocks(lights, 1);
  std::mt19937_64 random(1);
  for (const auto& normal : fibonacciSphere(20)) {
    const uint64_t present = random() | uint64_t{1};
    EXPECT_EQ(codec::decodeBlock(blocks.record(normal, 0, present), lights.size()).present, present);
  }
}

// Blocks of wood, cloth and gold need a few terms, neither one nor dozens.
TEST(DollBlocks, RanksArePlausible) {
  const DollBlocks blocks(lightsAround(60), 1);
  double ranks = 0, bytes = 0;
  const auto normals = fibonacciSphere(500);
  for (const auto& normal : normals) {
    const auto record = blocks.record(normal, normals.size(), ~uint64_t{0});
    const codec::Block block = codec::decodeBlock(record, 60);
    EXPECT_GE(block.rank, 1);
    EXPECT_LE(block.rank, 30);
    ranks += block.rank / 500.0;
    bytes += static_cast<double>(record.size()) / 500.0;
  }
  EXPECT_GT(ranks, 4);
  EXPECT_LT(ranks, 12);
  EXPECT_LT(bytes / (60 * codec::blockTexels), 0.6); // per pixel and light
}

// bench_parts makes the same check before it times packing.
TEST(DollBlocks, ErrLittleMoreThanTheBestOfTheirRank) {
  const auto lights = lightsAround(60);
  double ours = 0, best = 0;
  const auto normals = fibonacciSphere(12);
  for (size_t i = 0; i < normals.size(); ++i) {
    const Eigen::MatrixXf x = dollPatch(normals[i], lights, i);
    const codec::EncodedBlock encoded =
        codec::encodeBlock(~uint64_t{0}, x, DollBlocks::kTolerance, DollBlocks::kWhite);
    const Eigen::MatrixXd exact = x.cast<double>(), gram = exact.transpose() * exact;
    const Eigen::VectorXd squares = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram).eigenvalues();
    ours += encoded.squaredError;
    best += squares.head(squares.size() - encoded.rank).sum();
  }
  EXPECT_LT(std::sqrt(ours / best), 1.5);
  EXPECT_GE(ours, best);
}

TEST(DollBlocks, ShowTheSideThatIsLit) {
  const auto lights = lightsAround(30);
  const DollBlocks blocks(lights, 1);
  for (const auto& normal : fibonacciSphere(50)) {
    const codec::Block block = codec::decodeBlock(blocks.record(normal, 0, ~uint64_t{0}), lights.size());
    const auto green = [&](size_t light) {
      double sum = 0;
      for (int texel = 0; texel < codec::blockTexels; ++texel)
        for (int k = 0; k < block.rank; ++k)
          sum += block.texel(texel)[block.stride + k] * block.light(light)[k];
      return sum / codec::blockTexels;
    };
    for (size_t light = 0; light < lights.size(); ++light) {
      const double cosine = normal.dot(std::get<capture::DirectionalLight>(lights[light].kind).towards.raw());
      if (cosine < -0.3) {
        EXPECT_LT(green(light), 0.05);
      }
      if (cosine > 0.6) {
        EXPECT_GT(green(light), 0.06);
      }
    }
  }
}

} // namespace
} // namespace surflect::bench
