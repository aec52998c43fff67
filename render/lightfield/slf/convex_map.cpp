#include "render/lightfield/slf/convex_map.h"

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

namespace surflect::slf {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Angles and lengths are kept this far from 0, relative to a straight angle and to the mean length: weights
// stay positive and finite at triangles without area.
constexpr double kLeast = 1e-4;

double tangentOfHalfAngle(const Vec3<double>& a, const Vec3<double>& b) {
  const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
  return std::tan(std::clamp(angle, kLeast * std::numbers::pi, (1 - kLeast) * std::numbers::pi) / 2);
}

double meanEdge(const Disc& disc) {
  double sum = 0;
  for (const auto& triangle : disc.triangles)
    for (size_t k = 0; k < 3; ++k)
      sum += (disc.positions[triangle[(k + 1) % 3]] - disc.positions[triangle[k]]).norm();
  return sum / static_cast<double>(3 * disc.triangles.size());
}

} // namespace

struct ConvexMap::System {
  std::vector<uint32_t> border;
  std::vector<int> unknowns; // #vertices; row of each interior vertex, -1 - place in the border of others
  Sparse borderWeights;      // interior x border
  Eigen::SparseLU<Sparse> solver;
  bool isSolvable = true;
};

ConvexMap::ConvexMap(const Disc& disc, MeanWeights weights) {
  auto system = std::make_unique<System>();
  system->border = disc.border;
  system->unknowns.assign(disc.vertices.size(), 0);
  for (size_t i = 0; i < disc.border.size(); ++i) system->unknowns[disc.border[i]] = -1 - static_cast<int>(i);
  int count = 0;
  for (int& unknown : system->unknowns)
    if (unknown >= 0) unknown = count++;

  const double least = std::max(kLeast * meanEdge(disc), std::numeric_limits<double>::min());
  std::vector<Eigen::Triplet<double>> inner, outer;
  std::vector<double> sums(static_cast<size_t>(count), 0);
  // A triangle adds tan(angle / 2) / length to the weights of both edges at each corner.
  for (const auto& triangle : disc.triangles)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t at = triangle[k];
      const int row = system->unknowns[at];
      if (row < 0) continue;
      const std::array others = {triangle[(k + 1) % 3], triangle[(k + 2) % 3]};
      const Vec3<double> d = disc.positions[others[0]] - disc.positions[at];
      const Vec3<double> e = disc.positions[others[1]] - disc.positions[at];
      const double tangent = weights == MeanWeights::meanValue ? tangentOfHalfAngle(d, e) : 1;
      const std::array lengths = {d.norm(), e.norm()};
      for (size_t j = 0; j < 2; ++j) {
        const double weight =
            weights == MeanWeights::meanValue ? tangent * least / std::max(lengths[j], least) : 1;
        const int column = system->unknowns[others[j]];
        sums[static_cast<size_t>(row)] += weight;
        if (column >= 0)
          inner.emplace_back(row, column, -weight);
        else
          outer.emplace_back(row, -1 - column, weight);
      }
    }
  for (int row = 0; row < count; ++row) inner.emplace_back(row, row, sums[static_cast<size_t>(row)]);

  // Rows are scaled so that their weights sum to 1.
  Sparse matrix(count, count);
  matrix.setFromTriplets(inner.begin(), inner.end());
  system->borderWeights.resize(count, static_cast<int>(disc.border.size()));
  system->borderWeights.setFromTriplets(outer.begin(), outer.end());
  const Eigen::VectorXd scales =
      Eigen::Map<const Eigen::VectorXd>(sums.data(), static_cast<Eigen::Index>(sums.size())).cwiseInverse();
  matrix = (scales.asDiagonal() * matrix).eval();
  system->borderWeights = (scales.asDiagonal() * system->borderWeights).eval();
  if (count > 0) {
    system->solver.compute(matrix);
    system->isSolvable = system->solver.info() == Eigen::Success;
  }
  system_ = std::move(system);
}

ConvexMap::~ConvexMap() = default;
ConvexMap::ConvexMap(ConvexMap&&) noexcept = default;

std::vector<Vec2<double>> ConvexMap::operator()(std::span<const Vec2<double>> border) const {
  Eigen::MatrixX2d fixed(static_cast<Eigen::Index>(border.size()), 2);
  for (size_t i = 0; i < border.size(); ++i) fixed.row(static_cast<Eigen::Index>(i)) = border[i].transpose();
  Eigen::MatrixX2d inner(system_->borderWeights.rows(), 2);
  if (!system_->isSolvable)
    inner.setConstant(std::numeric_limits<double>::quiet_NaN());
  else if (inner.rows() > 0)
    inner = system_->solver.solve(Eigen::MatrixX2d(system_->borderWeights * fixed));
  std::vector<Vec2<double>> coordinates(system_->unknowns.size());
  for (size_t v = 0; v < coordinates.size(); ++v) {
    const int unknown = system_->unknowns[v];
    coordinates[v] = unknown >= 0 ? Vec2<double>(inner.row(unknown).transpose())
                                  : border[static_cast<size_t>(-1 - unknown)];
  }
  return coordinates;
}

} // namespace surflect::slf
