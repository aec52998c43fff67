#include "surfel/math/leading_svd.h"

#include "surfel/math/padded_products.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace surflect {

namespace {

// A block is a tall matrix of a few columns; `Blocks` are the columns of a wider matrix, in order.
template <class Real> using Blocks = std::vector<PaddedRows<Real>>;

// Widest block of which a product with X takes hardly longer than that of a single column.
constexpr size_t kBlock = 16;
constexpr size_t kMostSteps = 24;

template <class Real> void subtract(PaddedRows<Real>& from, const PaddedRows<Real>& other) {
  for (size_t i = 0; i < from.rows(); ++i)
    for (size_t j = 0; j < from.stride(); ++j) from.row(i)[j] -= other.row(i)[j];
}

// Numbers of -1..1 from a linear congruential generator.
template <class Real> void fillColumn(PaddedRows<Real>& block, size_t column, uint64_t& state) {
  for (size_t i = 0; i < block.rows(); ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    block.row(i)[column] = static_cast<Real>(static_cast<double>(state >> 11) * 0x1p-52 - 1);
  }
}

// Takes out of a block's columns what lies along earlier blocks.
template <class Real> void orthogonalise(PaddedRows<Real>& block, const Blocks<Real>& earlier) {
  for (const PaddedRows<Real>& other : earlier) subtract(block, product(other, innerProducts(other, block)));
}

template <class Real> double scalarProduct(const PaddedRows<Real>& block, size_t a, size_t b) {
  double sum = 0;
  for (size_t i = 0; i < block.rows(); ++i) sum += double{block.row(i)[a]} * double{block.row(i)[b]};
  return sum;
}

// Gram-Schmidt within a block: Z = Q R. Columns that are no longer than `negligible` leave a zero row in R
// and are replaced by random ones.
template <class Real> class Orthonormal {
public:
  Orthonormal(PaddedRows<Real> z, const Blocks<Real>& earlier, double negligible, uint64_t& random)
      : r(Eigen::MatrixXd::Zero(z.columns(), z.columns())), q(std::move(z)), isDone_(q.columns()) {
    orthogonalise(q, earlier);
    orthogonalise(q, earlier);
    for (size_t k = 0; k < q.columns(); ++k) {
      const double length = shortened(k, true);
      if (length <= negligible) continue;
      r(k, k) = length;
      finish(k, length);
    }
    if (std::ranges::all_of(isDone_, [](char isDone) { return isDone; })) return;
    for (size_t k = 0; k < q.columns(); ++k)
      if (!isDone_[k]) fillColumn(q, k, random);
    orthogonalise(q, earlier);
    orthogonalise(q, earlier);
    for (size_t k = 0; k < q.columns(); ++k)
      if (!isDone_[k]) finish(k, shortened(k, false));
  }

  Eigen::MatrixXd r;
  PaddedRows<Real> q;

private:
  // Takes the finished columns out of column k; returns the length that is left.
  double shortened(size_t k, bool isRecorded) {
    for (int pass = 0; pass < 2; ++pass)
      for (size_t j = 0; j < q.columns(); ++j) {
        if (!isDone_[j]) continue;
        const double along = scalarProduct(q, j, k);
        if (isRecorded) r(j, k) += along;
        for (size_t i = 0; i < q.rows(); ++i) q.row(i)[k] -= static_cast<Real>(along * double{q.row(i)[j]});
      }
    return std::sqrt(scalarProduct(q, k, k));
  }
  void finish(size_t k, double length) {
    for (size_t i = 0; i < q.rows(); ++i) q.row(i)[k] = static_cast<Real>(q.row(i)[k] / length);
    isDone_[k] = 1;
  }

  std::vector<char> isDone_; // columns of unit length, orthogonal to each other
};

template <class Real> double squaredNorm(const PaddedRows<Real>& m) {
  double sum = 0;
  for (size_t i = 0; i < m.rows(); ++i) {
    double ofRow = 0;
    for (size_t j = 0; j < m.columns(); ++j) ofRow += double{m.row(i)[j]} * double{m.row(i)[j]};
    sum += ofRow;
  }
  return sum;
}

// The columns of blocks combined: sum_j B_j W_j, each divided by `divisors`.
template <class Real>
PaddedRows<Real> combined(const Blocks<Real>& blocks, const Eigen::MatrixXd& weights,
                          const std::vector<double>& divisors) {
  PaddedRows<Real> sum(blocks[0].rows(), divisors.size());
  std::fill_n(sum.row(0), sum.rows() * sum.stride(), Real{0});
  size_t first = 0;
  for (const PaddedRows<Real>& block : blocks) {
    PaddedRows<Real> w(block.columns(), divisors.size());
    for (size_t i = 0; i < w.rows(); ++i)
      for (size_t k = 0; k < w.columns(); ++k)
        w.row(i)[k] = static_cast<Real>(-weights(first + i, k) / divisors[k]);
    subtract(sum, product(block, w));
    first += block.columns();
  }
  return sum;
}

template <class Real> Eigen::MatrixXd inDouble(const PaddedRows<Real>& m) {
  using RowMajor = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>(
             m.row(0), static_cast<Eigen::Index>(m.rows()), static_cast<Eigen::Index>(m.columns()),
             Eigen::OuterStride<>(static_cast<Eigen::Index>(m.stride())))
      .template cast<double>();
}

// Adds the last block's columns to the symmetric matrix of scalar products of all columns. They are in double
// precision, since small eigenvalues are lost in the rounding error of large ones.
template <class Real> void grow(Eigen::MatrixXd& gram, const Blocks<Real>& images) {
  const Eigen::MatrixXd last = inDouble(images.back());
  const Eigen::Index known = gram.rows();
  gram.conservativeResize(known + last.cols(), known + last.cols());
  Eigen::Index first = 0;
  for (const PaddedRows<Real>& image : images) {
    const Eigen::MatrixXd products = inDouble(image).transpose() * last;
    gram.block(first, known, products.rows(), products.cols()) = products;
    gram.block(known, first, products.cols(), products.rows()) = products.transpose();
    first += products.rows();
  }
}

// Eigenvectors of the Gram matrix by descending eigenvalue.
struct Ritz {
  explicit Ritz(const Eigen::MatrixXd& gram) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
    values = solver.eigenvalues().reverse();
    vectors = solver.eigenvectors().rowwise().reverse();
  }
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

} // namespace

template <class Real>
TruncatedSvd<Real> leadingSvd(const PaddedRows<Real>& x, size_t terms, double tolerated) {
  // T is X or X', whichever is tall.
  const bool isTall = x.columns() <= x.rows();
  const size_t size = std::min(x.rows(), x.columns());
  const auto tall = [&](const auto& block) { return isTall ? product(x, block) : innerProducts(x, block); };
  const auto wide = [&](const auto& block) { return isTall ? innerProducts(x, block) : product(x, block); };
  terms = std::min(terms, size);

  // Shorter terms than this share of the longest are rounding error.
  constexpr double kRounding = std::max(1e-7, 16 * double{std::numeric_limits<Real>::epsilon()});
  const double energy = squaredNorm(x);
  const double negligible = std::max(tolerated, kRounding * kRounding * energy);
  TruncatedSvd<Real> result{PaddedRows<Real>(x.rows(), 0), PaddedRows<Real>(x.columns(), 0), {}, energy};
  if (terms == 0 || !(energy > negligible)) return result;

  Blocks<Real> basis, images; // orthonormal Q; T Q
  Eigen::MatrixXd gram;
  uint64_t random = 1;
  PaddedRows<Real> next(size, std::min(size, std::max(kBlock, (terms + 11) / 8 * 8)));
  for (size_t k = 0; k < next.columns(); ++k) fillColumn(next, k, random);
  basis.push_back(Orthonormal<Real>(std::move(next), {}, 0, random).q);
  size_t spanned = 0;

  for (size_t step = 1;; ++step) {
    images.push_back(tall(basis.back()));
    grow(gram, images);
    spanned += basis.back().columns();
    const Ritz ritz(gram);
    const double largest = ritz.values[0];

    // Terms that are wanted of those found so far.
    size_t wanted = 0;
    double rest = energy;
    while (wanted < std::min(terms, spanned) && rest > negligible &&
           ritz.values[wanted] > kRounding * kRounding * largest)
      rest -= ritz.values[wanted++];

    bool isDone = spanned == size || step == kMostSteps;
    if (!isDone) {
      PaddedRows<Real> z = wide(images.back());
      if (spanned + z.columns() > size) { // the last block fills the space
        PaddedRows<Real> narrower(size, size - spanned);
        for (size_t i = 0; i < size; ++i) std::copy_n(z.row(i), narrower.columns(), narrower.row(i));
        basis.push_back(Orthonormal<Real>(std::move(narrower), basis, kRounding * largest, random).q);
        continue;
      }
      Orthonormal<Real> following(std::move(z), basis, kRounding * largest, random);
      const size_t block = basis.back().columns();
      const Eigen::MatrixXd residuals = following.r * ritz.vectors.bottomLeftCorner(block, wanted);
      isDone = wanted == 0 || residuals.colwise().norm().maxCoeff() <= kLeadingSvdError * largest;
      if (!isDone) basis.push_back(std::move(following.q));
    }
    if (!isDone) continue;

    std::vector<double> ones(wanted, 1.0), lengths;
    for (size_t k = 0; k < wanted; ++k) {
      result.energies.push_back(ritz.values[k]);
      lengths.push_back(std::sqrt(ritz.values[k]));
    }
    PaddedRows<Real> right = combined(basis, ritz.vectors, ones);
    PaddedRows<Real> along = combined(images, ritz.vectors, lengths);
    result.left = isTall ? std::move(along) : std::move(right);
    result.right = isTall ? std::move(right) : std::move(along);
    return result;
  }
}

template TruncatedSvd<float> leadingSvd(const PaddedRows<float>&, size_t, double);
template TruncatedSvd<double> leadingSvd(const PaddedRows<double>&, size_t, double);

} // namespace surflect
