// Codebooks by merging pairs of clusters.
#pragma once

#include "render/lightfield/lfm/vector_quantization.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <vector>

namespace surflect::lfm {

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
