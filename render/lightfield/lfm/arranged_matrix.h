// Vertex light field matrices as plain matrices of numbers, in the form that their factorisation needs.
//
// Rows and columns without an observed entry are left out. Channels are planes of columns: channel c of cell
// n is column c x stride + n, so that all channels share the weights of their entry.
#pragma once

#include "render/lightfield/lfm/factors.h"
#include "surfel/math/padded_rows.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace surflect::lfm {

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
