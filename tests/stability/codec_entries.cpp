#include "tests/stability/entry.h"

#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"
#include "srf/codec/view_encoder.h"
#include "surfel/base/error.h"

#include <Eigen/Dense>

#include <bit>
#include <random>

namespace surflect::stability {
namespace {

using codec::ChannelEnergies;

ChannelEnergies energiesOf(const Eigen::MatrixXd& x) {
  ChannelEnergies energies{Eigen::Matrix3Xd(3, x.cols()), x.rows() / 3};
  for (Eigen::Index l = 0; l < x.cols(); ++l)
    energies.sums.col(l) = x.col(l).reshaped(3, energies.texels).rowwise().squaredNorm();
  return energies;
}

Eigen::MatrixXd decodedOf(const codec::EncodedBlock& encoded, uint64_t present, Eigen::Index lights) {
  const codec::Block block = codec::decodeBlock(encoded.record, static_cast<size_t>(lights));
  Eigen::MatrixXd x(3 * std::popcount(present), lights);
  Eigen::Index row = 0;
  for (int texel = 0; texel < codec::blockTexels; ++texel) {
    if ((present >> texel & 1) == 0) continue;
    for (int channel = 0; channel < 3; ++channel, ++row)
      for (Eigen::Index l = 0; l < lights; ++l) {
        double sum = 0;
        for (int k = 0; k < block.stride; ++k)
          sum += double{block.light(static_cast<size_t>(l))[k]} *
                 static_cast<double>(block.texel(texel)[channel * block.stride + k]);
        x(row, l) = sum;
      }
  }
  return x;
}

// Eight components, each eigenimage and each row of coefficients rounded to 8 bits of its own peak.
Eigen::MatrixXd plainPca(const Eigen::MatrixXf& x) {
  const Eigen::JacobiSVD<Eigen::MatrixXf> svd(x, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::Index rank = std::min<Eigen::Index>(8, svd.singularValues().size());
  Eigen::MatrixXf images = svd.matrixU().leftCols(rank) * svd.singularValues().head(rank).asDiagonal(),
                  coefficients = svd.matrixV().leftCols(rank);
  for (Eigen::MatrixXf* factor : {&images, &coefficients})
    for (Eigen::Index k = 0; k < rank; ++k) {
      const float peak = factor->col(k).cwiseAbs().maxCoeff();
      factor->col(k) = (factor->col(k) / peak * 127).array().round().matrix() * (peak / 127);
    }
  return (images * coefficients.transpose()).cast<double>();
}

// Weighted error over the bound that a tolerance of 2 % sets.
Measured blockErrors(uint64_t present, const Eigen::MatrixXf& x) {
  constexpr double tolerance = 0.02, white = 1;
  const Eigen::MatrixXd truth = x.cast<double>();
  const ChannelEnergies energies = energiesOf(truth);
  const codec::BlockWeights weights = codec::blockWeights(energies, white);
  const double bound = codec::blockErrorBound(energies, weights, tolerance, white);
  const auto ratio = [&](const Eigen::MatrixXd& decoded) {
    if (!decoded.allFinite()) return kNoAnswer;
    return std::sqrt(codec::weightedSquares(energiesOf(decoded - truth), weights)) / bound;
  };
  return {ratio(plainPca(x)),
          ratio(decodedOf(codec::encodeBlock(present, x, tolerance, white), present, x.cols()))};
}

constexpr uint64_t kWhole = ~uint64_t{0};
constexpr int kLights = 24;

Eigen::MatrixXf noise(Eigen::Index rows, float scale) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0, scale);
  return Eigen::MatrixXf::NullaryExpr(rows, kLights, [&] { return uniform(random); });
}

// 1 if a picture with this value is taken without a word.
Measured acceptance(float value) {
  codec::ReflectanceStack stack{16, 16, std::vector<image::Image>(3, image::Image(16, 16, 3)),
                                image::Image(16, 16, 1)};
  std::ranges::fill(stack.alpha.values, 1.f);
  stack.lights[1].values[100] = value;
  Eigen::MatrixXf x = noise(192, 1);
  x(5, 5) = value;
  const bool naiveFinite = plainPca(x).allFinite();
  double ours = 1;
  try {
    codec::encodeView(stack, {});
  } catch (const Error&) {
    ours = 0;
  }
  return {naiveFinite ? 0 : kNoAnswer, ours};
}

} // namespace

Group codecGroup() {
  return {
      "Blocks of photographs",
      "the eight largest principal components in 8 bits each",
      {
          {"constant block", "within its bound", "error over bound", 1,
           [] { return blockErrors(kWhole, Eigen::MatrixXf::Constant(192, kLights, 0.7f)); }},
          {"black block", "black", "error over bound", 1,
           [] { return blockErrors(kWhole, Eigen::MatrixXf::Zero(192, kLights)); }},
          {"block of rank one", "within its bound", "error over bound", 1,
           [] {
             const Eigen::MatrixXf x = noise(192, 1).col(0) * noise(192, 1).row(0);
             return blockErrors(kWhole, x);
           }},
          {"one present pixel", "within its bound", "error over bound", 1,
           [] { return blockErrors(1, noise(3, 1)); }},
          {"a third of the pixels present", "within its bound", "error over bound", 1,
           [] {
             constexpr uint64_t third = 0x9249249249249249;
             return blockErrors(third, noise(3 * std::popcount(third), 1));
           }},
          {"noise: full rank", "within its bound", "error over bound", 1,
           [] { return blockErrors(kWhole, noise(192, 1)); }},
          {"pixels of 1e-6 and 1e6 under alternate lights", "within its bound", "error over bound", 1,
           [] {
             Eigen::MatrixXf x = noise(192, 1);
             for (Eigen::Index l = 0; l < kLights; ++l) x.col(l) *= l % 2 ? 1e6f : 1e-6f;
             return blockErrors(kWhole, x);
           }},
          {"pixels of 1e-6 and 1e6 side by side", "within its bound", "error over bound", 1,
           [] {
             Eigen::MatrixXf x = noise(192, 1e-6f);
             x.topRows(3) *= 1e12f;
             return blockErrors(kWhole, x);
           }},
          {"negative pixels of noise", "within its bound", "error over bound", 1,
           [] {
             const Eigen::MatrixXf x = noise(192, 0.02f).array() - 0.01f;
             return blockErrors(kWhole, x);
           }},
          {"a pixel that is not a number", "refused by the encoder; pack replaces it by black and reports it",
           "pictures taken", 0, [] { return acceptance(std::numeric_limits<float>::quiet_NaN()); }},
          {"an infinite pixel", "refused by the encoder; pack replaces it by black and reports it",
           "pictures taken", 0, [] { return acceptance(std::numeric_limits<float>::infinity()); }},
      }};
}

} // namespace surflect::stability
