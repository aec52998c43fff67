#include "render/lightfield/lfm/vector_quantization.h"

#include "surfel/base/error.h"
#include "surfel/math/matrix_products.h"
#include "surfel/math/padded_rows.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace surflect::lfm {

namespace {

constexpr size_t kBlock = 64; // vectors that are compared with all codewords at once

double squaredLength(std::span<const float> vector) {
  double sum = 0;
  for (const float x : vector) sum += double{x} * double{x};
  return sum;
}

// Bound on the rounding error of a scalar product of unit vectors: sums are of 32 products, then of such
// sums.
double roundingOf(size_t dimension) {
  return (static_cast<double>(dimension) / 32 + 64) * double{std::numeric_limits<float>::epsilon()};
}

} // namespace

double squaredDistance(std::span<const float> a, std::span<const float> b) {
  double sums[4] = {};
  for (size_t i = 0; i < a.size(); ++i) {
    const double difference = double{a[i]} - double{b[i]};
    sums[i % 4] += difference * difference;
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

Assignment nearestCodewords(const VectorSet& vectors, std::span<const float> codewords,
                            std::span<const uint32_t> before) {
  const size_t dimension = vectors.dimension, count = codewords.size() / dimension;
  PaddedRows<float> turned(dimension, count);
  std::vector<float> lengths(count);
  for (size_t i = 0; i < count; ++i) {
    const std::span<const float> codeword = codewords.subspan(i * dimension, dimension);
    lengths[i] = static_cast<float>(squaredLength(codeword));
    for (size_t d = 0; d < dimension; ++d) turned.row(d)[i] = codeword[d];
  }
  const double longest = std::sqrt(*std::ranges::max_element(lengths));
  const double rounding = roundingOf(dimension);

  Assignment result{std::vector<uint32_t>(vectors.size()), std::vector<double>(vectors.size())};
  const size_t blocks = (vectors.size() + kBlock - 1) / kBlock;
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    const size_t first = block * kBlock, size = std::min(kBlock, vectors.size() - first);
    PaddedRows<float> products(size, count);
    multiply(MatrixProduct<float>{vectors.values.data() + first * dimension, dimension, 1, turned.row(0),
                                  turned.stride(), products.row(0), products.stride(), size, dimension,
                                  turned.stride(), false});
    for (size_t i = 0; i < size; ++i) {
      // |x - c|^2 - |x|^2 = |c|^2 - 2 x c
      float* const scores = products.row(i);
      float least = std::numeric_limits<float>::infinity();
      for (size_t j = 0; j < count; ++j) {
        scores[j] = lengths[j] - 2 * scores[j];
        least = std::min(least, scores[j]);
      }
      const std::span<const float> x = vectors.values.subspan((first + i) * dimension, dimension);
      const double size_x = std::sqrt(squaredLength(x));
      const double margin = 4 * rounding * longest * (size_x + longest);
      double nearest = std::numeric_limits<double>::infinity();
      size_t index = 0;
      const auto consider = [&](size_t j) {
        const double square = squaredDistance(x, codewords.subspan(j * dimension, dimension));
        if (square < nearest) {
          nearest = square;
          index = j;
        }
      };
      if (!before.empty()) consider(before[first + i]);
      for (size_t j = 0; j < count; ++j)
        if (double{scores[j]} <= double{least} + margin) consider(j);
      result.indices[first + i] = static_cast<uint32_t>(index);
      result.squares[first + i] = nearest;
    }
  });
  return result;
}

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

namespace {

constexpr size_t kIterationsAfterSplit = 3;

void requireFinite(const VectorSet& vectors) {
  if (vectors.dimension == 0 || vectors.values.size() % vectors.dimension != 0)
    throw Error::mismatch("a multiple of the vectors' length, " + std::to_string(vectors.dimension),
                          std::to_string(vectors.values.size()) + " numbers")
        .at("vectors");
  for (size_t i = 0; i < vectors.values.size(); ++i)
    if (!std::isfinite(vectors.values[i]))
      throw Error::mismatch("a finite number", numberText(vectors.values[i]))
          .at("vectors[" + std::to_string(i / vectors.dimension) + "]");
  if (!vectors.weights.empty() && vectors.weights.size() != vectors.size())
    throw Error::mismatch(std::to_string(vectors.size()) + " numbers", std::to_string(vectors.weights.size()))
        .at("weights");
  for (size_t i = 0; i < vectors.weights.size(); ++i)
    if (!(vectors.weights[i] > 0) || !std::isfinite(vectors.weights[i]))
      throw Error::mismatch("a finite number above 0", numberText(vectors.weights[i]))
          .at("weights[" + std::to_string(i) + "]");
}

// Distinct vectors in the order in which they first occur, each with the weight of all that are equal to it.
struct Distinct {
  explicit Distinct(const VectorSet& vectors) : numberOf(vectors.size()) {
    const auto vector = [&](size_t i) {
      return vectors.values.subspan(i * vectors.dimension, vectors.dimension);
    };
    std::vector<uint32_t> order(vectors.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, [&](uint32_t a, uint32_t b) {
      return std::ranges::lexicographical_compare(vector(a), vector(b));
    });
    std::vector<uint32_t> first(vectors.size()); // of the vectors equal to each
    for (size_t i = 0; i < order.size(); ++i)
      first[order[i]] = i > 0 && std::ranges::equal(vector(order[i]), vector(order[i - 1]))
                            ? first[order[i - 1]]
                            : order[i];
    for (size_t i = 0; i < order.size(); ++i) {
      const float weight = vectors.weights.empty() ? 1 : vectors.weights[i];
      if (first[i] == i) {
        numberOf[i] = static_cast<uint32_t>(weights.size());
        values.insert(values.end(), vector(i).begin(), vector(i).end());
        weights.push_back(weight);
      } else {
        numberOf[i] = numberOf[first[i]];
        weights[numberOf[i]] += weight;
      }
    }
  }

  std::vector<uint32_t> numberOf; // distinct vector of each vector
  std::vector<float> values, weights;
};

// Codewords with the vectors that are nearest to them.
class Quantizer {
public:
  Quantizer(const VectorSet& vectors, std::vector<float> codewords)
      : vectors_(vectors), codewords_(std::move(codewords)), weight_(0) {
    for (const float weight : vectors.weights) weight_ += double{weight};
    assign();
  }

  size_t size() const { return codewords_.size() / vectors_.dimension; }
  double distortion() const { return distortion_; }
  const std::vector<float>& codewords() const { return codewords_; }
  const std::vector<uint32_t>& indices() const { return assignment_.indices; }

  // One Lloyd iteration. Returns whether the distortion fell; if not, nothing is changed.
  bool improve() {
    std::vector<float> oldCodewords = codewords_;
    Assignment oldAssignment = assignment_;
    const double oldDistortion = distortion_;
    centre();
    assign();
    if (distortion_ < oldDistortion) return true;
    codewords_ = std::move(oldCodewords);
    assignment_ = std::move(oldAssignment);
    distortion_ = oldDistortion;
    return false;
  }

  // Iterates until the distortion falls by less than the given share.
  void improve(size_t mostIterations, double convergence, std::vector<double>* distortions,
               const Progress& progress) {
    if (distortions) distortions->push_back(distortion_);
    for (size_t i = 0; i < mostIterations && distortion_ > 0; ++i) {
      progress.checkpoint();
      const double before = distortion_;
      if (!improve()) break;
      if (distortions) distortions->push_back(distortion_);
      if (before - distortion_ < convergence * before) break;
    }
  }

  // Splits the `count` codewords whose vectors have the largest errors in two, on both sides of the old one
  // towards and away from its farthest vector. Codewords without error stay; returns whether any was split.
  bool split(size_t count) {
    std::vector<double> errors(size());
    std::vector<size_t> farthest(size());
    std::vector<double> most(size(), 0);
    for (size_t i = 0; i < vectors_.size(); ++i) {
      const uint32_t codeword = assignment_.indices[i];
      errors[codeword] += double{vectors_.weights[i]} * assignment_.squares[i];
      if (assignment_.squares[i] > most[codeword]) {
        most[codeword] = assignment_.squares[i];
        farthest[codeword] = i;
      }
    }
    std::vector<size_t> order(size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::ranges::stable_sort(order, [&](size_t a, size_t b) { return errors[a] > errors[b]; });
    order.resize(std::min(count, order.size()));
    bool isSplit = false;
    for (const size_t codeword : order) {
      if (!(errors[codeword] > 0)) break;
      isSplit = true;
      const std::span<const float> far = vector(farthest[codeword]);
      for (size_t d = 0; d < vectors_.dimension; ++d) {
        const size_t place = codeword * vectors_.dimension + d;
        const float step = (far[d] - codewords_[place]) / 2;
        codewords_.push_back(codewords_[place] + step);
        codewords_[place] -= step;
      }
    }
    assignment_.indices.clear();
    assign();
    return isSplit;
  }

private:
  std::span<const float> vector(size_t i) const {
    return vectors_.values.subspan(i * vectors_.dimension, vectors_.dimension);
  }

  void assign() {
    assignment_ = nearestCodewords(vectors_, codewords_, assignment_.indices);
    double sum = 0;
    for (size_t i = 0; i < vectors_.size(); ++i) sum += double{vectors_.weights[i]} * assignment_.squares[i];
    distortion_ = sum / (weight_ * static_cast<double>(vectors_.dimension));
  }

  // Moves each codeword to the centroid of its vectors  [Gersho and Gray 1992, §11.2], or one that has none
  // to the vector with the largest error.
  void centre() {
    std::vector<std::vector<uint32_t>> members(size());
    for (size_t i = 0; i < vectors_.size(); ++i)
      members[assignment_.indices[i]].push_back(static_cast<uint32_t>(i));
    tbb::parallel_for(size_t{0}, size(), [&](size_t codeword) {
      if (members[codeword].empty()) return;
      std::vector<double> sum(vectors_.dimension);
      double weight = 0;
      for (const uint32_t i : members[codeword]) {
        const double w = double{vectors_.weights[i]};
        weight += w;
        for (size_t d = 0; d < sum.size(); ++d) sum[d] += w * double{vector(i)[d]};
      }
      for (size_t d = 0; d < sum.size(); ++d)
        codewords_[codeword * vectors_.dimension + d] = static_cast<float>(sum[d] / weight);
    });

    std::vector<size_t> empty;
    for (size_t codeword = 0; codeword < size(); ++codeword)
      if (members[codeword].empty()) empty.push_back(codeword);
    if (empty.empty()) return;
    std::vector<size_t> worst(vectors_.size());
    std::iota(worst.begin(), worst.end(), size_t{0});
    std::ranges::stable_sort(worst, [&](size_t a, size_t b) { return errorAt(a) > errorAt(b); });
    for (size_t i = 0; i < empty.size() && i < worst.size() && errorAt(worst[i]) > 0; ++i)
      std::ranges::copy(vector(worst[i]),
                        codewords_.begin() + static_cast<std::ptrdiff_t>(empty[i] * vectors_.dimension));
  }
  double errorAt(size_t i) const { return double{vectors_.weights[i]} * assignment_.squares[i]; }

  const VectorSet& vectors_; // has weights
  std::vector<float> codewords_;
  Assignment assignment_;
  double weight_, distortion_ = 0;
};

std::vector<float> centroidOf(const VectorSet& vectors) {
  std::vector<double> sum(vectors.dimension);
  double weight = 0;
  for (size_t i = 0; i < vectors.size(); ++i) {
    weight += double{vectors.weights[i]};
    for (size_t d = 0; d < sum.size(); ++d)
      sum[d] += double{vectors.weights[i]} * double{vectors.values[i * sum.size() + d]};
  }
  std::vector<float> centroid;
  for (const double component : sum) centroid.push_back(static_cast<float>(component / weight));
  return centroid;
}

// Splits codewords until there are enough, or the distortion is small enough.
void grow(Quantizer& quantizer, size_t most, double distortion, const Progress& progress) {
  while (quantizer.size() < most && quantizer.distortion() > distortion) {
    // Near the distortion that is asked for, a few codewords at a time.
    const size_t step =
        quantizer.distortion() > 2 * distortion ? quantizer.size() : (quantizer.size() + 7) / 8;
    if (!quantizer.split(std::min(step, most - quantizer.size()))) break;
    quantizer.improve(kIterationsAfterSplit, 0, nullptr, progress);
    progress.checkpoint();
  }
}

} // namespace

Codebook codebookOf(const VectorSet& vectors, const CodebookOptions& options, const Progress& progress) {
  requireFinite(vectors);
  Codebook codebook{vectors.dimension, {}, {}, {}};
  if (vectors.size() == 0) return codebook;
  const Distinct distinct(vectors);
  const size_t all = distinct.weights.size();
  const size_t most = options.codewords == 0 ? all : std::min(options.codewords, all);
  if (most == all && !(options.distortion > 0)) {
    codebook.codewords = distinct.values;
    codebook.indices = distinct.numberOf;
    codebook.distortions = {0};
    return codebook;
  }

  const VectorSet set{vectors.dimension, distinct.values, distinct.weights};
  const bool isSplit = options.start == CodebookStart::split;
  Quantizer quantizer(set,
                      isSplit ? centroidOf(set) : pairwiseMerged(set, most, options.distortion, progress));
  grow(quantizer, most, options.distortion, progress);
  quantizer.improve(options.mostIterations, options.convergence, &codebook.distortions, progress);

  // Codewords that have vectors, in order.
  std::vector<uint32_t> numbers(quantizer.size(), 0);
  for (const uint32_t index : quantizer.indices()) numbers[index] = 1;
  uint32_t used = 0;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] == 0) continue;
    numbers[i] = used++;
    const auto from = quantizer.codewords().begin() + static_cast<std::ptrdiff_t>(i * vectors.dimension);
    codebook.codewords.insert(codebook.codewords.end(), from,
                              from + static_cast<std::ptrdiff_t>(vectors.dimension));
  }
  for (const uint32_t number : distinct.numberOf)
    codebook.indices.push_back(numbers[quantizer.indices()[number]]);
  return codebook;
}

} // namespace surflect::lfm
