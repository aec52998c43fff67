// Factors of a vertex light field, a sum of products of surface maps and view maps; and the arranged matrices
// from which they are computed.
//
// [Chen 2002] Chen, Bouguet, Chu, Grzeszczuk: Light Field Mapping: Efficient Representation and
// Hardware Rendering of Surface Light Fields.
//
//   F ~ mean + sum_k u_k v_k'   [Chen 2002, Eq. 5]
//   F    vertex light field matrix: radiance at surface samples (rows) in cells of view directions (columns)
//   u_k  surface map: a number for each sample
//   v_k  view map: a number for each cell and channel. There are three, RGB; or four, with a root of opacity
//   M, N numbers of samples and of cells
#pragma once

#include "surfel/math/padded_rows.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::lfm {

enum class Factorization {
  pca, // principal components: maps are signed, a mean is taken out
  nmf  // non-negative matrix factorisation: maps are positive, there is no mean
};

// Vertex light field matrix F. An entry is a sample in a cell, with its channels.
struct LightFieldMatrix {
  size_t samples = 0, cells = 0;
  std::span<const float> radiance; // [samples][cells][channels]
  std::span<const float> weights;  // [samples][cells], >= 0; 0 where nothing was observed. Empty: all are 1
  size_t channels = 3;
  std::span<const float> cellWeights = {}; // [cells], >= 0, which multiply the weights. Empty: all are 1
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

// Vertex light field matrices as plain matrices of numbers, in the form that their factorisation needs.
// Rows and columns without an observed entry are left out. Channels are planes of columns: channel c of cell
// n is column c x stride + n, so that all channels share the weights of their entry.

// Samples and cells with an entry that counts in the fit.
struct Observed {
  std::vector<uint32_t> samples, cells;
  float leastWeight = 0, largestWeight = 0;
};

// Entries count by their weight, at least `leastWeight`; not if a channel is not finite, or if the weight is
// below kNegligibleWeight of the largest. Throws Error if sizes do not fit, or a weight is negative or not
// finite.
Observed observedOf(const LightFieldMatrix& matrix, float leastWeight = 0);

inline constexpr float kNegligibleWeight = 1e-6f;

struct ArrangedMatrix {
  size_t planes = 3;                        // channels
  size_t stride = 0;                        // columns: planes x stride, stride >= #cells; 0 beyond the cells
  size_t cells = 0;                         // observed
  PaddedRows<float> values{0, 0};           // [rows][planes x stride]; 0 where not observed
  std::optional<PaddedRows<float>> weights; // [rows][cells], 0..1; none if all are 1

  ArrangedMatrix copy() const;
  size_t rows() const { return values.rows(); }
  float* plane(size_t row, size_t c) { return values.row(row) + c * stride; }
  const float* plane(size_t row, size_t c) const { return values.row(row) + c * stride; }
};

ArrangedMatrix arranged(const LightFieldMatrix& matrix, const Observed& observed);

// Factors of an arranged matrix: values ~ mean + U V'.
struct PlainFactors {
  PaddedRows<float> surface{0, 0}; // U [rows][terms]
  PaddedRows<float> view{0, 0};    // V [planes x stride][terms]
  std::vector<float> mean;         // [rows][planes]; empty if none was taken out
  size_t terms() const { return surface.columns(); }
};

} // namespace surflect::lfm
