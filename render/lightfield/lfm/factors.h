// Factors of a vertex light field: a sum of products of surface maps and view maps.
//
// [Chen et al. 2002] Chen, Bouguet, Chu, Grzeszczuk: Light Field Mapping: Efficient Representation and
// Hardware Rendering of Surface Light Fields.
//
//   F ~ mean + sum_k u_k v_k'   [Chen et al. 2002, Eq. 5]
//   F    vertex light field matrix: radiance at surface samples (rows) in cells of view directions (columns)
//   u_k  surface map: a number for each sample
//   v_k  view map: a number for each cell and channel. There are three, RGB; or four, with a root of opacity
//   M, N numbers of samples and of cells
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::lfm {

enum class Method {
  pca, // principal components: maps are signed, a mean is taken out
  nmf  // non-negative matrix factorisation: maps are positive, there is no mean
};

// Vertex light field matrix F. An entry is a sample in a cell, with its channels.
struct LightFieldMatrix {
  size_t samples = 0, cells = 0;
  std::span<const float> radiance; // [samples][cells][channels]
  std::span<const float> weights;  // [samples][cells], >= 0; 0 where nothing was observed. Empty: all are 1
  size_t channels = 3;
};

struct FactorTerm {
  std::vector<float> surface; // u_k [samples]
  std::vector<float> view;    // v_k [cells][channels]
};

struct Factors {
  size_t samples = 0, cells = 0;
  std::vector<float> mean; // the mean view [samples][channels]; empty if none was taken out
  std::vector<FactorTerm> terms;
  size_t channels = 3;
};

// The mean and the first `terms` terms, or all if there are fewer, multiplied out:
// [samples][cells][channels].
std::vector<float> product(const Factors& factors, size_t terms);

// Errors are summed over observed entries, so that those of several vertices can be added.
struct FactorError {
  double squares = 0; // sum of weight x squared error, over the entries and their channels
  double weight = 0;  // sum of weights, each counted for all channels
  double rms() const;
};

// Error of the first `terms` terms. Entries that are not finite are not observed.
FactorError errorOf(const Factors& factors, size_t terms, const LightFieldMatrix& matrix);

} // namespace surflect::lfm
