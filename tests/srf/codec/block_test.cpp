#include "srf/codec/block.h"

#include "srf/codec/block_encoder.h"
#include "tests/srf/codec/synthetic.h"
#include "tests/support/each_simd.h"

#include <array>

namespace surflect::codec {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;
using synthetic::random;

constexpr uint64_t full = ~uint64_t{0};

// Rows of the present texels, as decoded.
MatrixXd decoded(const EncodedBlock& encoded, uint64_t present, Eigen::Index lights) {
  const Block block = decodeBlock(encoded.record, lights);
  MatrixXd radiance(3 * std::popcount(present), lights);
  Eigen::Index row = 0;
  for (uint64_t rest = present; rest != 0; rest &= rest - 1)
    for (int c = 0; c < 3; ++c, ++row)
      for (Eigen::Index l = 0; l < lights; ++l) {
        radiance(row, l) = 0;
        for (int k = 0; k < block.stride; ++k)
          radiance(row, l) +=
              double{block.light(l)[k]} * block.texel(std::countr_zero(rest))[c * block.stride + k];
      }
  return radiance;
}

struct Case {
  std::string name;
  uint64_t present;
  MatrixXf radiance;
};

std::vector<Case> cases() {
  std::mt19937 generator(1);
  const uint64_t some = 0x00f0'ff81'0300'1007;
  const int rows = 3 * std::popcount(some);
  const MatrixXf spike = Eigen::VectorXf::Unit(192, 5) * Eigen::VectorXf::Unit(28, 7).transpose();
  MatrixXf highlights = MatrixXf::Constant(192, 28, 0.01f);
  for (int i = 0; i < 28; ++i) highlights(7 * i, i) = 1e4f;
  MatrixXf saturated = 1e-4f * random(192, 28, generator); // red light on red paint
  for (int row = 0; row < 192; row += 3) saturated.row(row) *= 1e4f;
  std::vector<Case> all = {
      {"random", full, random(192, 28, generator)},
      {"random, some texels", some, random(rows, 28, generator)},
      {"more lights than values", 1, random(3, 60, generator)},
      {"one light", full, random(192, 1, generator)},
      {"low rank", full, random(192, 3, generator) * random(3, 28, generator)},
      {"low rank and noise", some,
       random(rows, 2, generator) * random(2, 28, generator) + 0.01f * random(rows, 28, generator)},
      {"constant", full, MatrixXf::Constant(192, 28, 0.25f)},
      {"negative", full, MatrixXf::Constant(192, 28, -0.5f) - random(192, 28, generator).cwiseAbs()},
      {"one value", full, spike},
      {"one texel, one light", 1ull << 63, MatrixXf::Constant(3, 1, 0.7f)},
      {"highlights", full, highlights},
      {"saturated", full, saturated},
      {"saturated, one light", full, saturated.col(0)},
      {"bright", full, 1e4f * random(192, 28, generator)},
      {"beyond half floats", some, 1e8f * random(rows, 28, generator)},
      {"faint", full, 1e-4f * random(192, 28, generator)},
      {"below half floats", full, 1e-9f * random(192, 28, generator)},
  };
  return all;
}

// The weighted matrix V X W.
MatrixXd weighed(const MatrixXd& x, const BlockWeights& weights) {
  return weights.channels.replicate(x.rows() / 3, 1).asDiagonal() * x * weights.lights.asDiagonal();
}

// Squares of a matrix with rows and columns as in encodeBlock.
ChannelEnergies blockSquares(const Eigen::MatrixXd& x) {
  ChannelEnergies squares{Eigen::Matrix3Xd(3, x.cols()), x.rows() / 3};
  for (Eigen::Index l = 0; l < x.cols(); ++l)
    squares.sums.col(l) = x.col(l).reshaped(3, squares.texels).rowwise().squaredNorm();
  return squares;
}

TEST(Block, EveryBlockKeepsItsBoundAfterQuantisation) {
  for (const auto& [name, present, radiance] : cases())
    for (const double tolerance : {0.3, 0.1, 0.03, 0.01, 1e-3, 0.})
      for (const double white : {1e-6, 1.0, 1e4}) {
        const MatrixXd x = radiance.cast<double>();
        const ChannelEnergies squares = blockSquares(x);
        const BlockWeights weights = blockWeights(squares, white);
        const EncodedBlock encoded = encodeBlock(present, radiance, tolerance, white);
        const MatrixXd error = decoded(encoded, present, x.cols()) - x;
        const double bound = blockErrorBound(squares, weights, tolerance, white);
        EXPECT_LE(weighed(error, weights).norm(), bound * (1 + 1e-12))
            << name << ", tolerance " << tolerance << ", white " << white;
        EXPECT_NEAR(error.squaredNorm(), encoded.squaredError, 1e-9 * encoded.squaredError) << name;
      }
}

// The tolerated error is constant in the dark, then grows with the square root of radiance, and beyond white
// with radiance.
TEST(Block, ErrorsMayGrowWithTheLightAsThoseOfACameraDo) {
  const auto allowed = [](double rms) { return 1 / errorWeight(rms, 2); };
  EXPECT_NEAR(allowed(0), std::sqrt(0.01), 1e-15);
  EXPECT_NEAR(allowed(2e-4), std::sqrt(0.01), 1e-3);
  EXPECT_NEAR(allowed(0.8) / allowed(0.2), 2, 0.25);
  EXPECT_NEAR(allowed(4000) / allowed(2000), 2, 1e-3);
  EXPECT_DOUBLE_EQ(errorWeight(0.3, 1), errorWeight(300, 1000));
}

// Under one light, a highlight is a hundred times as bright as the block under the others. The total error
// must stay below the error that the highlight alone would tolerate.
TEST(Block, ADimLightKeepsItsDetailBesideAHighlight) {
  std::mt19937 generator(3);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::MatrixXf x = 0.05f * random(192, 12, generator).cwiseAbs();
    x.col(trial % 12) *= 100;
    const Eigen::MatrixXd got = decoded(encodeBlock(~uint64_t{0}, x, 0.02, 1), ~uint64_t{0}, 12);
    const Eigen::MatrixXd error = got - x.cast<double>();
    double dim = 0, norm = 0;
    for (Eigen::Index l = 0; l < 12; ++l)
      if (l != trial % 12) {
        dim += error.col(l).squaredNorm();
        norm += x.col(l).cast<double>().squaredNorm();
      }
    // The whole bound spent on the dim lights, which have about equal weights.
    const BlockWeights weights = blockWeights(blockSquares(x.cast<double>()), 1);
    EXPECT_LE(std::sqrt(dim),
              0.02 * weighed(x.cast<double>(), weights).norm() / weights.lights[(trial + 1) % 12] * 1.1);
    EXPECT_LT(std::sqrt(dim / norm), 0.05); // without weights, 0.02 would allow 0.6
  }
}

// Blue paint has a little red, which only a red lamp reveals.
TEST(Block, ADimChannelKeepsItsDetailBesideABrightOne) {
  std::mt19937 generator(4);
  for (int trial = 0; trial < 20; ++trial) {
    MatrixXf x = 0.5f * random(192, 12, generator).cwiseAbs();
    for (int row = 0; row < 192; row += 3) x.row(row) *= 0.04f;
    const MatrixXd error = decoded(encodeBlock(full, x, 0.1, 1), full, 12) - x.cast<double>();
    const auto norms = [](const MatrixXd& m) { // red, blue
      const auto channel = [&](int c) { return m(Eigen::seq(c, Eigen::last, 3), Eigen::all).norm(); };
      return std::array{channel(0), channel(2)};
    };
    const auto [red, blue] = norms(error);
    EXPECT_LT(red, 0.5 * blue);
    EXPECT_LT(red / norms(x.cast<double>())[0], 0.6); // without weights, 0.1 would allow 3.6
  }
}

// Mean of each channel over texels and lights.
Eigen::Vector3d channelMeans(const MatrixXd& x) {
  return x.rowwise().mean().reshaped(3, x.rows() / 3).rowwise().mean();
}

// A block whose three channels differ by up to four orders of magnitude.
MatrixXf unlikeChannels(int texels, int lights, int rank, std::mt19937& generator) {
  MatrixXf x = MatrixXf::Zero(3 * texels, lights);
  for (int k = 0; k < rank; ++k)
    x += std::pow(0.3f, static_cast<float>(k)) * random(3 * texels, 1, generator).cwiseAbs() *
         random(1, lights, generator).cwiseAbs();
  std::uniform_real_distribution<float> decades(-4, 0);
  for (int c = 0; c < 3; ++c)
    x(Eigen::seq(c, Eigen::last, 3), Eigen::all) *= std::pow(10.f, decades(generator));
  return x;
}

TEST(Block, EachChannelKeepsItsMeanWhateverTheTolerance) {
  std::mt19937 generator(9);
  for (int trial = 0; trial < 30; ++trial) {
    const uint64_t present = trial % 3 == 0 ? full : uint64_t{generator()} << 16 | 1;
    const int lights = 1 + static_cast<int>(generator() % 40), rank = 1 + trial % 5;
    const MatrixXf x = unlikeChannels(std::popcount(present), lights, rank, generator);
    const Eigen::Vector3d means = channelMeans(x.cast<double>());
    for (const double tolerance : {0.3, 0.1, 0.03, 0.01, 1e-3}) {
      const MatrixXd got = decoded(encodeBlock(present, x, tolerance, 1), present, lights);
      const Eigen::Vector3d errors = (channelMeans(got) - means).cwiseAbs();
      for (int c = 0; c < 3; ++c)
        EXPECT_LE(errors[c], channelMeanBound(means[c], 1) * (1 + 1e-9)) << trial << ", " << tolerance;
    }
  }
}

// With the nearest of 127 levels, blue at 3.175 levels would come back as 3 under every light.
TEST(Block, APlainSurfaceKeepsItsHueUnderEachLight) {
  std::mt19937 generator(10);
  const Eigen::Vector3f albedo(0.8f, 0.1f, 0.02f);
  for (const double tolerance : {0.02, 0.03}) {
    double squares = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const MatrixXf shading = (random(64, 3, generator) * 0.02f).array() + 1;
      const MatrixXf shown = shading * random(3, 12, generator).cwiseAbs();
      MatrixXf x(192, 12);
      for (int c = 0; c < 3; ++c) x(Eigen::seq(c, Eigen::last, 3), Eigen::all) = albedo[c] * shown;
      const MatrixXd error = decoded(encodeBlock(full, x, tolerance, 1), full, 12) - x.cast<double>();
      for (int c = 0; c < 3; ++c) {
        const MatrixXd ofChannel = error(Eigen::seq(c, Eigen::last, 3), Eigen::all);
        squares += (ofChannel.colwise().mean() / (albedo[c] * shown.mean())).squaredNorm();
      }
    }
    EXPECT_LT(std::sqrt(squares / (20 * 3 * 12)), 0.006) << tolerance;
  }
}

// Beside red at a million times white, blue at a ten-thousandth of white is below the resolution of 16 bits.
TEST(Block, AMeanOutOfReachIsNoError) {
  std::mt19937 generator(11);
  MatrixXf x = random(192, 12, generator).cwiseAbs();
  for (int row = 0; row < 192; ++row) x.row(row) *= row % 3 == 0 ? 1e6f : 1e-4f;
  const MatrixXd got = decoded(encodeBlock(full, x, 0.02, 1), full, 12);
  const Eigen::Vector3d means = channelMeans(x.cast<double>()),
                        errors = (channelMeans(got) - means).cwiseAbs();
  EXPECT_LE(errors[0], channelMeanBound(means[0], 1));
  EXPECT_LE(errors.tail(2).maxCoeff(), 2.5e-4 * means[0]);
}

TEST(Block, AGrayBlockWeighsItsChannelsAlike) {
  const MatrixXd gray = MatrixXd::Constant(192, 5, 0.3);
  EXPECT_LT((blockWeights(blockSquares(gray), 1).channels - Eigen::Vector3d::Ones()).norm(), 1e-14);
}

TEST(Block, AToleranceThatCannotBeReachedIsTakenAsOneThatCan) {
  for (const auto& [name, present, x] : cases())
    EXPECT_EQ(encodeBlock(present, x, 0, 1e-6).record, encodeBlock(present, x, 1e-13, 1e-6).record) << name;
}

TEST(Block, ErrorFallsAndSizeGrowsAsToleranceTightens) {
  std::mt19937 generator(2);
  const Eigen::VectorXf falling = Eigen::VectorXf::LinSpaced(28, 0, -9).array().exp();
  const MatrixXf x =
      random(192, 28, generator).cwiseAbs() * falling.asDiagonal() * random(28, 28, generator).cwiseAbs();
  EncodedBlock coarser = encodeBlock(full, x, 0.25, 1);
  for (double tolerance = 0.125; tolerance > 1e-3; tolerance /= 2) {
    EncodedBlock finer = encodeBlock(full, x, tolerance, 1);
    EXPECT_LT(finer.squaredError, coarser.squaredError) << tolerance;
    EXPECT_GT(finer.record.size(), coarser.record.size()) << tolerance;
    EXPECT_GE(finer.rank, coarser.rank) << tolerance;
    coarser = std::move(finer);
  }
  EXPECT_GT(coarser.rank, 10);
}

TEST(Block, ZeroBlockHasRankZero) {
  const EncodedBlock encoded = encodeBlock(full, MatrixXf::Zero(192, 28), 0, 1);
  EXPECT_EQ(encoded.rank, 0);
  EXPECT_EQ(encoded.squaredError, 0);
  EXPECT_EQ(encoded.record.size(), 4u);
  EXPECT_EQ(decodeBlock(encoded.record, 28).rank, 0);
}

// In the dark, the mean of a block may err as much as at a thousandth of white.
TEST(Block, ABlockDarkerThanItsErrorMayBeHasRankZero) {
  const auto rank = [](double value) {
    return encodeBlock(full, MatrixXf::Constant(192, 28, static_cast<float>(value)), 0.03, 1).rank;
  };
  const double limit = channelMeanBound(0, 1);
  EXPECT_EQ(limit, 2e-6);
  EXPECT_EQ(rank(0.999 * limit), 0);
  EXPECT_EQ(rank(1.001 * limit), 1);
}

TEST(Block, LowRankBlockIsStoredWithItsRank) {
  std::mt19937 generator(3);
  for (int rank = 1; rank <= 6; ++rank) {
    const MatrixXf x = random(192, rank, generator) * random(rank, 28, generator);
    EXPECT_EQ(encodeBlock(full, x, 1e-3, 1).rank, rank);
  }
}

// Four bits per value and per light, and one float of scale: exactly the size that such levels need.
TEST(Block, RecordIsAsSmallAsItsTermsAllow) {
  std::mt19937 generator(4);
  const auto levels = [&](int rows, int columns) -> MatrixXf {
    return random(rows, columns, generator).unaryExpr([](float x) {
      return std::clamp(std::round(3 * x), -7.f, 7.f);
    });
  };
  MatrixXf image = levels(192, 1), lights = levels(1, 28);
  image(0) = lights(0) = 7;
  const MatrixXf x = image * lights;
  EXPECT_EQ(encodeBlock(full, x, 0.25, 1).record.size(), 4u + 4 + 28 / 2 + 192 / 2);
  const uint64_t three = 0b10101;
  EXPECT_EQ(encodeBlock(three, x.topRows(9), 0.25, 1).record.size(), 4u + 8 + 4 + 28 / 2 + 5);
}

TEST(Block, CoefficientsBecomeFloatsWhereHalvesOverflow) {
  std::mt19937 generator(5);
  const MatrixXf x = random(192, 1, generator) * random(1, 28, generator);
  const auto bytes = [&](float scale) { return encodeBlock(full, scale * x, 1e-3, 1).record.size(); };
  EXPECT_EQ(bytes(1e6f), bytes(1) + 28 * 2);
}

TEST(Block, EveryKindOfVectorInstructionsGivesTheSameRecord) {
  for (const auto& [name, present, x] : cases())
    for (const double tolerance : {0.3, 0.03, 1e-3, 0.})
      for (const Simd simd : EachSimd()) {
        const auto record = [&, &present = present, &x = x] {
          return encodeBlock(present, x, tolerance, 1).record;
        };
        EXPECT_EQ(record(), inSimd(Simd::scalar, record))
            << name << ", " << nameOf(simd) << ", tolerance " << tolerance;
      }
}

// For a few outliers of an image, clipping costs less than coarser steps for all other values.
TEST(Block, FourBitsAreNotSpreadOverOutliers) {
  std::mt19937 generator(8);
  MatrixXf image = random(192, 1, generator).cwiseAbs().cwiseMin(1.f).array() + 0.5f;
  image(20) = 3; // if it set the last level, all others would err by more than a tenth
  const MatrixXf x = image * random(1, 28, generator).array().sign().matrix();
  EXPECT_EQ(encodeBlock(full, x, 0.1, 1).record.size(), 4u + 4 + 28 / 2 + 192 / 2);
  EXPECT_EQ(encodeBlock(full, x, 0.09, 1).record.size(), 4u + 4 + 28 / 2 + 192 / 2);
}

// The clipped error ignores differences above white and below black, which a viewer cannot see.
TEST(Block, ClippedErrorIsThatOfClippedValues) {
  std::mt19937 generator(6);
  const MatrixXf x = random(192, 28, generator);
  const EncodedBlock encoded = encodeBlock(full, x, 0.1, 0.8);
  const MatrixXd stored = decoded(encoded, full, 28);
  double expected = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    expected += std::pow(std::clamp(double{x.data()[i]}, 0., 0.8) - std::clamp(stored.data()[i], 0., 0.8), 2);
  EXPECT_NEAR(encoded.clippedSquaredError, expected, 1e-12 * expected);
  EXPECT_LT(encoded.clippedSquaredError, encoded.squaredError);
}

TEST(Block, AbsentTexelsRepeatTheNearestPresentOne) {
  std::mt19937 generator(7);
  for (int trial = 0; trial < 20; ++trial) {
    const uint64_t present = (uint64_t{generator()} << 32 | generator()) & generator() & ~1ull;
    if (present == 0) continue;
    const MatrixXf x = random(3 * std::popcount(present), 28, generator);
    const Block block = decodeBlock(encodeBlock(present, x, 0.01, 1).record, 28);
    EXPECT_EQ(block.present, present);
    for (int t = 0; t < blockTexels; ++t) {
      const auto squaredTo = [&](int other) {
        const int dx = other % blockSize - t % blockSize, dy = other / blockSize - t / blockSize;
        return dx * dx + dy * dy;
      };
      int nearest = -1; // the first of equally near ones
      for (int other = 0; other < blockTexels; ++other)
        if ((present >> other & 1) && (nearest < 0 || squaredTo(other) < squaredTo(nearest))) nearest = other;
      EXPECT_TRUE(std::equal(block.texel(t), block.texel(t) + 3 * block.stride, block.texel(nearest))) << t;
    }
  }
}

TEST(Block, EveryTruncationAndEveryExtensionOfARecordIsRejected) {
  for (const auto& [name, present, x] : cases()) {
    auto record = encodeBlock(present, x, 0.05, 1).record;
    for (size_t size = 0; size < record.size(); ++size)
      EXPECT_THROW(decodeBlock(std::span(record).first(size), x.cols()), Error) << name << ", " << size;
    record.push_back(std::byte{0});
    EXPECT_THROW(decodeBlock(record, x.cols()), Error) << name;
  }
}

// Even a record forged with a valid checksum must not crash the reader.
TEST(Block, DamagedRecordDecodesToModestNumbersOrIsRejected) {
  int rejected = 0;
  for (const auto& [name, present, x] : cases()) {
    const auto record = encodeBlock(present, x, 0.05, 1).record;
    for (size_t i = 0; i < record.size(); ++i) {
      auto damaged = record;
      damaged[i] = ~damaged[i];
      try {
        const Block block = decodeBlock(damaged, x.cols());
        for (size_t l = 0; l < block.lights; ++l)
          for (int k = 0; k < block.stride; ++k) ASSERT_LT(std::abs(block.light(l)[k]), 1e33f) << name;
      } catch (const Error&) {
        ++rejected;
      }
    }
  }
  EXPECT_GT(rejected, 50);
}

std::vector<uint8_t> joined(std::vector<uint8_t> front, const std::vector<uint8_t>& back) {
  front.insert(front.end(), back.begin(), back.end());
  return front;
}

template <class Number> void append(std::vector<std::byte>& record, Number number) {
  const auto bytes = std::as_bytes(std::span(&number, 1));
  record.insert(record.end(), bytes.begin(), bytes.end());
}

// A 16-bit record can hold levels beyond those that the writer uses.
TEST(Block, LevelsBeyondTheLastAreTheLast) {
  std::vector<std::byte> record;
  append(record, uint8_t{3}); // float coefficients, partly present
  for (const uint8_t terms : std::array<uint8_t, 3>{1, 0, 0}) append(record, terms);
  append(record, uint64_t{1});
  append(record, 1.f);
  for (const int16_t level : std::array<int16_t, 3>{32767, -32768, 32640}) append(record, level);
  const Block block = decodeBlock(record, 1);
  ASSERT_EQ(block.stride, 8);
  for (const auto& [channel, level] : {std::pair{0, 127}, {1, -127}, {2, 127}})
    for (int plane = 0; plane < 2; ++plane)
      EXPECT_EQ(block.texel(0)[channel * block.stride + plane], level) << channel << ' ' << plane;
  EXPECT_NEAR(127 * (block.light(0)[0] + block.light(0)[1]), 1, 1e-6);
}

// Levels of 8 and 4 bits have one more value below zero than above. With three values, the second byte of
// 4-bit levels is half used.
TEST(Block, LevelsOfFewBitsAreNoLowerThanTheyAreHigh) {
  for (const auto& [bits, bytes] : {std::pair{8, std::vector<int>{-128, 127, -127}}, {4, {0x78, 0x08}}}) {
    const int last = bits == 8 ? 127 : 7;
    std::vector<std::byte> record;
    append(record, uint8_t{2}); // partly present
    for (const uint8_t terms : std::array<uint8_t, 3>{0, uint8_t(bits == 8), uint8_t(bits == 4)})
      append(record, terms);
    append(record, uint64_t{1});
    append(record, 1.f);
    for (int values = 0; values < 2; ++values) // for three lights, then for three channels
      for (const int byte : bytes) append(record, static_cast<uint8_t>(byte));
    const Block block = decodeBlock(record, 3);
    for (const auto& [i, sign] : {std::pair{0, -1}, {1, 1}, {2, -1}}) {
      EXPECT_EQ(block.texel(0)[i * block.stride], sign * last) << bits;
      EXPECT_FLOAT_EQ(block.light(static_cast<size_t>(i))[0],
                      static_cast<float>(sign) / static_cast<float>(last))
          << bits;
    }
  }
}

TEST(Block, WhatPadsTermsIsZeroAndTheirMemoryBeginsALine) {
  for (const auto& [name, present, x] : cases()) {
    const auto lights = static_cast<size_t>(x.cols());
    const auto record = encodeBlock(present, x, 0.05, 1).record;
    const Block block = decodeBlock(record, lights);
    EXPECT_EQ(reinterpret_cast<uintptr_t>(block.values.data()) % 64, 0u) << name;
    const int terms = block.rank + std::to_integer<int>(record[1]); // 16-bit terms count twice
    for (int k = terms; k < block.stride; ++k) {
      for (size_t l = 0; l < lights; ++l) ASSERT_EQ(block.light(l)[k], 0) << name;
      for (int t = 0; t < blockTexels; ++t)
        for (int c = 0; c < 3; ++c) ASSERT_EQ(block.texel(t)[c * block.stride + k], 0) << name;
    }
  }
}

TEST(Block, MeaninglessRecordsNameTheirField) {
  const auto fieldOf = [](std::vector<uint8_t> bytes) {
    try {
      decodeBlock(std::as_bytes(std::span(bytes)), 2);
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("none");
  };
  EXPECT_EQ(fieldOf({4, 0, 0, 0}), "flags");
  EXPECT_EQ(fieldOf({2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), "present");
  EXPECT_EQ(fieldOf({0, 1, 1, 1}), "rank");
  const std::vector<uint8_t> half = {0, 0x7c}, single = {0, 0, 0x80, 0x7f}; // infinity
  const std::vector<uint8_t> restOfHalves(2 + 6), restOfLevels(1 + 2);      // for two lights and three rows
  EXPECT_EQ(fieldOf(joined({2, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, joined(half, restOfHalves))),
            "coefficients");
  EXPECT_EQ(fieldOf(joined({2, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0}, joined(single, restOfLevels))),
            "coefficients");
}

TEST(Block, ARecordTooShortForItsLightsIsRefusedBeforeTheyHaveMemory) {
  const std::array<uint8_t, 300> record{0, 0, 0, 1};
  EXPECT_THROW(decodeBlock(std::as_bytes(std::span(record)), size_t{1} << 50), Error);
}

} // namespace
} // namespace surflect::codec
