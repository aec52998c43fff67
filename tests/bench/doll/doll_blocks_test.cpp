#include "bench/doll/doll_blocks.h"

#include "bench/doll/spiral.h"
#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace surflect::bench {
namespace {

// A smooth block plus noise; the tolerance decides how many terms of which precision there are.
std::vector<std::byte> encoded(size_t lights, double tolerance, std::mt19937_64& random) {
  std::normal_distribution<float> gauss;
  Eigen::MatrixXf radiance(3 * codec::blockTexels, lights);
  for (Eigen::Index column = 0; column < radiance.cols(); ++column)
    for (Eigen::Index row = 0; row < radiance.rows(); ++row)
      radiance(row, column) =
          std::cos(0.02f * static_cast<float>(row * (column + 1))) + 0.05f * gauss(random);
  return codec::encodeBlock(~uint64_t{0}, radiance, tolerance, 1).record;
}

TEST(DollBlocks, WithoutTexelsTheOthersStayAsTheyAre) {
  std::mt19937_64 random(1);
  int precisions = 0; // bits: 16, 8, 4 met
  for (const double tolerance : {0.3, 0.1, 0.03, 0.003, 0.0003})
    for (int i = 0; i < 20; ++i) {
      const size_t lights = 1 + random() % 20;
      const auto record = encoded(lights, tolerance, random);
      for (int p = 0; p < 3; ++p)
        precisions |= record[1 + static_cast<size_t>(p)] != std::byte{0} ? 1 << p : 0;
      const uint64_t present = random() | random();
      const codec::Block all = codec::decodeBlock(record, lights);
      const codec::Block part = codec::decodeBlock(withTexels(record, lights, present), lights);
      ASSERT_EQ(part.present, present);
      ASSERT_EQ(part.rank, all.rank);
      EXPECT_TRUE(std::equal(part.light(0), part.light(lights), all.light(0)));
      for (int texel = 0; texel < codec::blockTexels; ++texel) {
        if (!(present >> texel & 1)) continue;
        for (int value = 0; value < 3 * all.stride; ++value)
          ASSERT_EQ(part.texel(texel)[value], all.texel(texel)[value]) << texel;
      }
    }
  EXPECT_EQ(precisions, 7);
}

TEST(DollBlocks, AllTexelsAreTheRecordItself) {
  std::mt19937_64 random(2);
  const auto record = encoded(7, 0.05, random);
  EXPECT_EQ(withTexels(record, 7, ~uint64_t{0}), record);
}

// A record may hold no more terms than it has rows.
TEST(DollBlocks, AFewTexelsKeepTheFirstTerms) {
  std::mt19937_64 random(3);
  for (int texel = 0; texel < codec::blockTexels; ++texel) {
    const auto record = encoded(16, 0.003, random);
    const codec::Block all = codec::decodeBlock(record, 16);
    ASSERT_GT(all.rank, 3);
    const codec::Block one = codec::decodeBlock(withTexels(record, 16, uint64_t{1} << texel), 16);
    ASSERT_EQ(one.rank, 3);
    for (int channel = 0; channel < 3; ++channel)
      for (int k = 0; k < 3; ++k)
        EXPECT_EQ(one.texel(texel)[channel * one.stride + k], all.texel(texel)[channel * all.stride + k]);
  }
}

std::vector<capture::Light> lightsAround(size_t count) {
  std::vector<capture::Light> lights;
  for (const auto& towards : spiral(count))
    lights.push_back(
        {"", "",
         capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}}});
  return lights;
}

// What surfaces of wood, cloth and gold need here: neither one term nor dozens.
TEST(DollBlocks, RanksArePlausible) {
  const DollBlocks blocks(lightsAround(60), 1);
  double ranks = 0, bytes = 0;
  const auto normals = spiral(500);
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
  EXPECT_LT(bytes / (60 * codec::blockTexels), 0.6); // a pixel and light
}

// What bench_doll measures of packing: few terms, and an error little above the least that so many can have.
TEST(DollBlocks, ErrLittleMoreThanTheBestOfTheirRank) {
  const auto lights = lightsAround(60);
  double ours = 0, best = 0;
  const auto normals = spiral(12);
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
  for (const auto& normal : spiral(50)) {
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
