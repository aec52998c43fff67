#include "render/lightfield/slf/parametrization.h"

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

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

// Point of the lower side at 0..1 of its length: a parabola through the corners that touches y = 0.
Vec2<double> lowerSide(double along, double bulge) {
  const double x = bulge + (1 - 2 * bulge) * along;
  const double fromMiddle = 2 * along - 1;
  return {x, bulge * fromMiddle * fromMiddle};
}

// Turned by quarters of a turn about the middle of the square.
Vec2<double> quarterTurns(Vec2<double> p, size_t quarters) {
  for (size_t i = 0; i < quarters; ++i) p = Vec2<double>(1 - p.y(), p.x());
  return p;
}

constexpr std::array<SquareShape, kRoughest + 1> kShapes = {SquareShape{0.02, 0}, SquareShape{0.05, 0.5},
                                                            SquareShape{0.15, 1}};

// A border of three vertices keeps its shape: its longest edge lies along the lower side.
std::vector<Vec2<double>> triangleInSquare(const Disc& disc) {
  size_t base = 0;
  double longest = -1;
  const auto corner = [&](size_t i) -> const Vec3<double>& { return disc.positions[disc.border[i % 3]]; };
  for (size_t i = 0; i < 3; ++i)
    if (const double length = (corner(i + 1) - corner(i)).norm(); length > longest)
      longest = length, base = i;
  const Vec3<double> along = corner(base + 1) - corner(base), up = corner(base + 2) - corner(base);
  const double foot = longest > 0 ? std::clamp(up.dot(along) / along.squaredNorm(), 0.0, 1.0) : 0.5;
  std::vector<Vec2<double>> result(3);
  result[base] = {0, 0};
  result[(base + 1) % 3] = {1, 0};
  result[(base + 2) % 3] = {foot, 1};
  return result;
}

MeanWeights weightsFor(int roughness) {
  return roughness == 0 ? MeanWeights::meanValue : MeanWeights::uniform;
}

class CornerSearch {
public:
  CornerSearch(const Disc& disc, int roughness)
      : disc_(disc), shape_(kShapes[static_cast<size_t>(roughness)]), map_(disc, weightsFor(roughness)) {
    // Triangles whose corners are all on the border are nearly flat on a side of the square: their stretch
    // would outweigh all others.
    std::vector<uint8_t> isBorder(disc.vertices.size(), 0);
    for (const uint32_t v : disc.border) isBorder[v] = 1;
    for (const auto& [i, j, k] : disc.triangles)
      if (!(isBorder[i] && isBorder[j] && isBorder[k])) triangles_.push_back({i, j, k});
    const size_t n = disc.border.size();
    reached_.assign(n + 1, 0);
    for (size_t i = 0; i < n; ++i)
      reached_[i + 1] =
          reached_[i] + (disc.positions[disc.border[(i + 1) % n]] - disc.positions[disc.border[i]]).norm();
    for (size_t i = 0; i <= n; ++i)
      reached_[i] =
          reached_[n] > 0 ? reached_[i] / reached_[n] : static_cast<double>(i) / static_cast<double>(n);
  }

  std::vector<Vec2<double>> run() {
    // Rectangles of several aspects around the border; their sides take turns to be the wide ones.
    constexpr int kTurns = 8;
    for (const double wide : {0.25, 0.2, 0.3, 0.15, 0.35})
      for (int turn = 0; turn < kTurns; ++turn) {
        const double start = 0.5 * turn / kTurns;
        tryCorners(nearest({start, start + wide, start + 0.5, start + 0.5 + wide}));
      }
    // Then each corner on its own, by shorter and shorter steps.
    const auto n = static_cast<ptrdiff_t>(disc_.border.size());
    for (ptrdiff_t step = std::max<ptrdiff_t>(1, n / 16); step > 0; step /= 2)
      for (size_t corner = 0; corner < 4; ++corner)
        for (const ptrdiff_t move : {step, -step})
          while (tryCorners(moved(best_, corner, move))) {
          }
    return std::move(coordinates_);
  }

private:
  // Border vertices nearest to four fractions of the border's length, made distinct.
  SquareCorners nearest(std::array<double, 4> fractions) const {
    const size_t n = disc_.border.size();
    SquareCorners corners{};
    for (size_t i = 0; i < 4; ++i) {
      const double fraction = fractions[i] - std::floor(fractions[i]);
      const auto above = static_cast<size_t>(std::ranges::lower_bound(reached_, fraction) - reached_.begin());
      const bool isBelow = above > 0 && fraction - reached_[above - 1] < reached_[above] - fraction;
      corners[i] = (isBelow ? above - 1 : above) % n;
    }
    std::ranges::sort(corners);
    for (size_t i = 1; i < 4; ++i) corners[i] = std::max(corners[i], corners[i - 1] + 1);
    for (size_t i = 4; i-- > 0;) corners[i] = std::min(corners[i], n - 4 + i);
    return corners;
  }

  SquareCorners moved(SquareCorners corners, size_t corner, ptrdiff_t move) const {
    const auto n = static_cast<ptrdiff_t>(disc_.border.size());
    corners[corner] = static_cast<size_t>((static_cast<ptrdiff_t>(corners[corner]) + move + n) % n);
    std::ranges::sort(corners);
    return corners;
  }

  bool tryCorners(const SquareCorners& corners) {
    for (size_t i = 1; i < 4; ++i)
      if (corners[i] == corners[i - 1]) return false;
    std::vector<Vec2<double>> coordinates = map_(squareBorder(disc_, corners, shape_));
    const double stretch = stretchSums(disc_.positions, triangles_, coordinates).leastStretch();
    if (!coordinates_.empty() && !(stretch < stretch_)) return false;
    best_ = corners, stretch_ = stretch, coordinates_ = std::move(coordinates);
    return true;
  }

  const Disc& disc_;
  SquareShape shape_;
  ConvexMap map_;
  std::vector<double> reached_;                    // share of the border's length before each of its vertices
  std::vector<std::array<uint32_t, 3>> triangles_; // that count
  SquareCorners best_ = {};
  double stretch_ = 0;
  std::vector<Vec2<double>> coordinates_;
};

} // namespace

double StretchSums::leastStretch() const {
  // A sum of infinity and 0 is infinite, where their product is not a number.
  return std::isfinite(a + c) ? 2 * std::sqrt(a) * std::sqrt(c) : std::numeric_limits<double>::infinity();
}

double StretchSums::bestAspect() const { return std::sqrt(a / c); }

StretchSums stretchSums(std::span<const Vec3<double>> positions,
                        std::span<const std::array<uint32_t, 3>> triangles,
                        std::span<const Vec2<double>> coordinates) {
  StretchSums sums;
  for (const auto& [i, j, k] : triangles) {
    const std::array q = {positions[i], positions[j], positions[k]};
    const std::array p = {coordinates[i], coordinates[j], coordinates[k]};
    const double area = (q[1] - q[0]).cross(q[2] - q[0]).norm() / 2;
    const double flat = planeArea(p[0], p[1], p[2]);
    sums.area += area, sums.planeArea += flat;
    if (!(flat > 0)) {
      sums.a = sums.c = std::numeric_limits<double>::infinity();
      continue;
    }
    // With edges from the first corner, S_s and S_t need no differences of far positions.
    const Vec3<double> d = q[1] - q[0], e = q[2] - q[0];
    const Vec2<double> pd = p[1] - p[0], pe = p[2] - p[0];
    const Vec3<double> ss = (d * pe.y() - e * pd.y()) / (2 * flat),
                       st = (e * pd.x() - d * pe.x()) / (2 * flat);
    sums.a += area * ss.squaredNorm(), sums.c += area * st.squaredNorm();
  }
  return sums;
}

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

std::vector<Vec2<double>> squareBorder(const Disc& disc, const SquareCorners& corners,
                                       const SquareShape& shape) {
  const size_t n = disc.border.size();
  assert(n >= 4 && corners[0] < corners[1] && corners[1] < corners[2] && corners[2] < corners[3] &&
         corners[3] < n);
  assert(shape.bulge > 0 && shape.bulge < 1.0 / 6);
  const auto positionOf = [&](size_t i) -> const Vec3<double>& { return disc.positions[disc.border[i % n]]; };
  std::vector<Vec2<double>> result(n);
  for (size_t side = 0; side < 4; ++side) {
    const size_t first = corners[side], count = side < 3 ? corners[side + 1] - first : corners[0] + n - first;
    std::vector<double> reached(count + 1, 0);
    for (size_t i = 0; i < count; ++i)
      reached[i + 1] = reached[i] + (positionOf(first + i + 1) - positionOf(first + i)).norm();
    for (size_t i = 0; i < count; ++i) {
      const double even = static_cast<double>(i) / static_cast<double>(count);
      const double byLength = reached[count] > 0 ? reached[i] / reached[count] : even;
      const double along = byLength + shape.evenness * (even - byLength);
      result[(first + i) % n] = quarterTurns(lowerSide(along, shape.bulge), side);
    }
  }
  return result;
}

Parametrization parametrizationOf(const Disc& disc, int roughness) {
  Parametrization result;
  if (disc.border.size() > 3)
    result.coordinates = CornerSearch(disc, roughness).run();
  else
    result.coordinates = ConvexMap(disc, weightsFor(roughness))(triangleInSquare(disc));
  result.stretch = stretchSums(disc.positions, disc.triangles, result.coordinates);
  return result;
}

} // namespace surflect::slf
