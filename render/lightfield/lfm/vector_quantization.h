// Vector quantisation: a codebook of few vectors, each of which stands for the vectors nearest to it.
//
// [Gersho and Gray 1992] Gersho, Gray: Vector Quantization and Signal Compression.
// [Linde et al. 1980] Linde, Buzo, Gray: An Algorithm for Vector Quantizer Design.
// [Equitz 1989] Equitz: A New Vector Quantization Clustering Algorithm.
#pragma once

#include "surfel/base/progress.h"

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

} // namespace surflect::lfm
