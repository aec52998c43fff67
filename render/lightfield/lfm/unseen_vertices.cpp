#include "render/lightfield/lfm/unseen_vertices.h"

#include <cassert>
#include <utility>

namespace surflect::lfm {

Vec3<float> meanRoot(const VertexMatrix& matrix, const RingRows& rows) {
  assert(rows.rows() == matrix.rows);
  Vec3<double> sum = Vec3<double>::Zero();
  double weights = 0;
  for (size_t row = 0; row < matrix.rows; ++row)
    for (size_t cell = 0; cell < matrix.cells; ++cell) {
      const auto weight = static_cast<double>(matrix.weights[row * matrix.cells + cell]);
      if (weight == 0) continue;
      for (size_t c = 0; c < 3; ++c)
        sum[static_cast<Eigen::Index>(c)] += weight * static_cast<double>(matrix.value(row, cell, c));
      weights += weight * static_cast<double>(rows.hats[row]);
    }
  return weights > 0 ? Vec3<float>((sum / weights).cast<float>()) : Vec3<float>::Zero();
}

void spreadToUnseen(const Rings& rings, std::span<const uint8_t> isSeen, std::span<Vec3<float>> roots) {
  assert(isSeen.size() == roots.size());
  std::vector<uint8_t> isKnown(isSeen.begin(), isSeen.end());
  std::vector<std::pair<uint32_t, Vec3<float>>> found;
  do {
    found.clear();
    for (const uint32_t v : rings.vertices()) {
      if (isKnown[v]) continue;
      Vec3<float> sum = Vec3<float>::Zero();
      float count = 0;
      for (const auto& [triangle, corner] : rings.around(v))
        for (const uint32_t other : rings.corners()[triangle])
          if (isKnown[other]) sum += roots[other], ++count;
      if (count > 0) found.emplace_back(v, sum / count);
    }
    for (const auto& [v, mean] : found) isKnown[v] = 1, roots[v] = mean;
  } while (!found.empty());
}

VertexMatrix constantMatrix(const RingRows& rows, size_t cells, const Vec3<float>& root) {
  VertexMatrix matrix{rows.rows(), cells, {}, {}, rows.rows(), 0};
  matrix.weights.assign(rows.rows() * cells, 0);
  matrix.values.resize(3 * rows.rows() * cells);
  for (size_t row = 0; row < rows.rows(); ++row)
    for (size_t cell = 0; cell < cells; ++cell)
      for (size_t c = 0; c < 3; ++c)
        matrix.value(row, cell, c) = rows.hats[row] * root[static_cast<Eigen::Index>(c)];
  return matrix;
}

} // namespace surflect::lfm
