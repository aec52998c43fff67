// Vector quantisation: a codebook of few vectors, each of which stands for the vectors nearest to it.
//
// [Gersho and Gray 1992] Gersho, Gray: Vector Quantization and Signal Compression.
// [Linde et al. 1980] Linde, Buzo, Gray: An Algorithm for Vector Quantizer Design.
// [Equitz 1989] Equitz: A New Vector Quantization Clustering Algorithm.
#pragma once

#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Vectors of equal length.
struct VectorSet {
  size_t dimension = 0;
  std::span<const float> values;  // [vectors][dimension]
  std::span<const float> weights; // [vectors], > 0: how much the error of a vector counts. Empty: all are 1
  size_t size() const { return dimension ? values.size() / dimension : 0; }
};

enum class CodebookStart {
  split,                   // codewords are split until there are enough  [Linde et al. 1980]
  pairwiseNearestNeighbors // clusters of single vectors are merged until few are left  [Equitz 1989]
};

struct CodebookOptions {
  CodebookStart start = CodebookStart::split;
  size_t codewords = 0;  // at most; 0: no bound
  double distortion = 0; // mean squared error of a component that suffices; 0: no bound
  size_t mostIterations = 20;
  double convergence = 1e-3; // iteration ends once the distortion falls by less than this share in one
};

struct Codebook {
  size_t dimension = 0;
  std::vector<float> codewords;  // [codewords][dimension]
  std::vector<uint32_t> indices; // codeword of each vector
  std::vector<double>
      distortions; // mean squared error of a component, after each Lloyd iteration; never rises
  size_t size() const { return dimension ? codewords.size() / dimension : 0; }
  std::span<const float> codeword(size_t i) const {
    return std::span(codewords).subspan(i * dimension, dimension);
  }
};

// Codebook by the generalised Lloyd algorithm with squared Euclidean distance  [Gersho and Gray 1992, §11.3].
//
// Equal vectors have one codeword. If `codewords` is no less than the number of distinct vectors, or neither
// bound is given, the codebook is the set of distinct vectors, in the order in which they first occur. A
// codeword that loses all its vectors moves to the vector with the largest error; if there is none, it is
// removed. A vector that is equally near to several codewords takes the first, unless one of them is its own
// so far. The result is the same for any number of threads. Throws Error for values or weights that are not
// finite, and weights that are not above 0; and Cancelled.
Codebook codebookOf(const VectorSet& vectors, const CodebookOptions& options, const Progress& progress = {});

// Nearest codewords of vectors, exactly.

// |a - b|^2
double squaredDistance(std::span<const float> a, std::span<const float> b);

struct Assignment {
  std::vector<uint32_t> indices; // nearest codeword of each vector
  std::vector<double> squares;   // squared distance to it
};

// Nearest codeword of each vector; of several, the first, unless `before` names one of them. `before` may be
// empty. Distances to all codewords are a product of matrices; those that are nearest within its rounding
// error are computed again in double precision.
Assignment nearestCodewords(const VectorSet& vectors, std::span<const float> codewords,
                            std::span<const uint32_t> before);

// Codebooks by merging pairs of clusters.

// Largest number of vectors, evenly spread over the set, from which merging starts. Time and memory grow with
// its square.
inline constexpr size_t kMostPairwise = 4096;

// Centroids of clusters. At first every vector is a cluster; then the two clusters whose merging adds least
// to the distortion are merged, again and again [Equitz 1989]: w_i w_j / (w_i + w_j) |c_i - c_j|^2. Ends when
// at most `codewords` are left (if `codewords` is above 0), and the next merging would bring the mean squared
// error of a component above `distortion`.
std::vector<float> pairwiseMerged(const VectorSet& vectors, size_t codewords, double distortion,
                                  const Progress& progress);

} // namespace surflect::lfm
