#include "render/lightfield/lfm/pairwise_merging.h"

#include "surfel/math/padded_products.h"
#include "surfel/math/padded_rows.h"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace surflect::lfm {

namespace {

class Clusters {
public:
  explicit Clusters(const VectorSet& vectors)
      : dimension_(vectors.dimension), size_(std::min(vectors.size(), kMostPairwise)),
        centroids_(size_ * dimension_), costs_(size_, size_), isAlive_(size_, 1), left_(size_) {
    PaddedRows<float> rows(size_, dimension_);
    for (size_t i = 0; i < size_; ++i) {
      const size_t from = i * vectors.size() / size_;
      weights_.push_back(vectors.weights.empty() ? 1 : double{vectors.weights[from]});
      for (size_t d = 0; d < dimension_; ++d)
        rows.row(i)[d] = vectors.values[from * dimension_ + d],
        centroids_[i * dimension_ + d] = double{rows.row(i)[d]};
    }
    const PaddedRows<float> products = product(rows, transposed(rows));
    for (size_t i = 0; i < size_; ++i)
      for (size_t j = 0; j < size_; ++j) {
        const double square =
            double{products.row(i)[i]} + double{products.row(j)[j]} - 2 * double{products.row(i)[j]};
        costs_.row(i)[j] = static_cast<float>(std::max(0.0, square) * weights_[i] * weights_[j] /
                                              (weights_[i] + weights_[j]));
      }
    for (size_t i = 0; i < size_; ++i) nearest_.push_back(nearestOf(i));
  }

  size_t left() const { return left_; }
  double weight() const {
    double sum = 0;
    for (const double w : weights_) sum += w;
    return sum;
  }

  // Two clusters whose merging costs least, and that cost.
  struct Pair {
    size_t first = 0, second = 0;
    float cost = std::numeric_limits<float>::infinity();
  };
  Pair cheapest() const {
    Pair best;
    for (size_t i = 0; i < size_; ++i)
      if (isAlive_[i] && nearest_[i] != i && costs_.row(i)[nearest_[i]] < best.cost)
        best = {i, nearest_[i], costs_.row(i)[nearest_[i]]};
    return best;
  }

  void merge(const Pair& pair) {
    const auto [i, j] = std::minmax(pair.first, pair.second);
    const double wi = weights_[i], wj = weights_[j];
    for (size_t d = 0; d < dimension_; ++d) {
      double& c = centroids_[i * dimension_ + d];
      c = (wi * c + wj * centroids_[j * dimension_ + d]) / (wi + wj);
    }
    isAlive_[j] = 0;
    --left_;
    for (size_t k = 0; k < size_; ++k) {
      if (!isAlive_[k] || k == i) continue;
      const double wk = weights_[k];
      const double cost = ((wi + wk) * double{costs_.row(i)[k]} + (wj + wk) * double{costs_.row(j)[k]} -
                           wk * double{pair.cost}) /
                          (wi + wj + wk);
      costs_.row(i)[k] = costs_.row(k)[i] = static_cast<float>(std::max(0.0, cost));
    }
    weights_[i] = wi + wj;
    weights_[j] = 0;
    nearest_[i] = nearestOf(i);
    for (size_t k = 0; k < size_; ++k) {
      if (!isAlive_[k] || k == i) continue;
      if (nearest_[k] == i || nearest_[k] == j)
        nearest_[k] = nearestOf(k);
      else if (costs_.row(k)[i] < costs_.row(k)[nearest_[k]])
        nearest_[k] = i;
    }
  }

  std::vector<float> centroids() const {
    std::vector<float> result;
    for (size_t i = 0; i < size_; ++i)
      if (isAlive_[i])
        for (size_t d = 0; d < dimension_; ++d)
          result.push_back(static_cast<float>(centroids_[i * dimension_ + d]));
    return result;
  }

private:
  // The cluster that is cheapest to merge with; i itself if there is no other.
  size_t nearestOf(size_t i) const {
    size_t best = i;
    float least = std::numeric_limits<float>::infinity();
    for (size_t j = 0; j < size_; ++j)
      if (isAlive_[j] && j != i && costs_.row(i)[j] < least) {
        least = costs_.row(i)[j];
        best = j;
      }
    return best;
  }

  size_t dimension_, size_;
  std::vector<double> centroids_, weights_;
  PaddedRows<float> costs_; // of merging i and j
  std::vector<char> isAlive_;
  std::vector<size_t> nearest_;
  size_t left_;
};

} // namespace

std::vector<float> pairwiseMerged(const VectorSet& vectors, size_t codewords, double distortion,
                                  const Progress& progress) {
  Clusters clusters(vectors);
  const double tolerated = distortion * clusters.weight() * static_cast<double>(vectors.dimension);
  double squares = 0;
  while (clusters.left() > 1) {
    progress.checkpoint();
    const Clusters::Pair pair = clusters.cheapest();
    const bool isFewEnough = codewords == 0 || clusters.left() <= codewords;
    if (isFewEnough && squares + double{pair.cost} > tolerated) break;
    clusters.merge(pair);
    squares += double{pair.cost};
  }
  return clusters.centroids();
}

} // namespace surflect::lfm
