#include "render/lightfield/lfm/factorization_reference.h"

#include <Eigen/Core>

#include <cmath>
#include <random>

namespace surflect::lfm {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 10000;

// Strictly positive.
MatrixXd randomMatrix(Eigen::Index rows, Eigen::Index columns, std::mt19937_64& random) {
  return MatrixXd::NullaryExpr(rows, columns,
                               [&] { return static_cast<double>((random() >> 11) + 1) * 0x1p-53; });
}

MatrixXd quotient(const MatrixXd& a, const MatrixXd& b) {
  return a.binaryExpr(
      b, [](double numerator, double denominator) { return denominator > 0 ? numerator / denominator : 0; });
}

} // namespace

ReferenceFactors referencePca(const MatrixXd& f, int terms, double convergence) {
  ReferenceFactors factors{MatrixXd::Zero(f.rows(), terms), MatrixXd::Zero(f.cols(), terms)};
  std::mt19937_64 random(1);
  for (int p = 0; p < terms; ++p) {
    const MatrixXd fp = f - factors.u * factors.v.transpose();
    const auto timesAp = [&](const VectorXd& v) -> VectorXd { return fp.transpose() * (fp * v); };
    VectorXd v = randomMatrix(f.cols(), 1, random).normalized();
    for (int i = 0; i < kMostIterations; ++i) {
      const VectorXd next = timesAp(v);
      if (next.isZero(0)) break;
      const double change = (next.normalized() - v).norm();
      v = next.normalized();
      if (change < convergence) break;
    }
    // The appendix takes the root of a vector; its length is meant, which makes lambda the singular value.
    const double lambda = std::sqrt(timesAp(v).norm());
    if (!(lambda > 0)) continue;
    const VectorXd u = fp * v / lambda;
    const double maxU = u.cwiseAbs().maxCoeff(), maxV = v.cwiseAbs().maxCoeff();
    const double alpha = std::sqrt(maxU * lambda / maxV);
    factors.u.col(p) = lambda * u / alpha;
    factors.v.col(p) = alpha * v;
  }
  return factors;
}

ReferenceFactors referenceNmf(const MatrixXd& f, int terms, int iterations, uint64_t seed) {
  std::mt19937_64 random(seed);
  MatrixXd u = randomMatrix(f.rows(), terms, random), v = randomMatrix(f.cols(), terms, random);
  for (int i = 0; i < iterations; ++i) {
    const MatrixXd un = quotient(f * v, u * (v.transpose() * v));
    const MatrixXd vn = quotient(f.transpose() * u, v * (u.transpose() * u));
    u = u.cwiseProduct(un);
    v = v.cwiseProduct(vn);
    for (int k = 0; k < terms; ++k)
      if (const double sum = u.col(k).sum(); sum > 0) u.col(k) /= sum;
  }
  return {u, v};
}

} // namespace surflect::lfm
