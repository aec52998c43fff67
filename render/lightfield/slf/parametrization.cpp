#include "render/lightfield/slf/parametrization.h"

#include "render/lightfield/slf/convex_map.h"
#include "render/lightfield/slf/square_border.h"
#include "render/lightfield/slf/stretch_descent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace surflect::slf {

namespace {

constexpr double kGapTexels = 2; // width of a gap in the border

constexpr std::array<SquareShape, kRoughest + 1> kShapes = {SquareShape{0.02, 0}, SquareShape{0.02, 0},
                                                            SquareShape{0.05, 0.5}, SquareShape{0.15, 1}};

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
  return roughness <= 1 ? MeanWeights::meanValue : MeanWeights::uniform;
}

class CornerSearch {
public:
  CornerSearch(const Disc& disc, int roughness)
      : disc_(disc), shape_(kShapes[static_cast<size_t>(roughness)]), map_(disc, weightsFor(roughness)) {
    // Triangles whose corners are all on the border are nearly flat on a side of the square, until the border
    // moves: their stretch would outweigh all others.
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

Parametrization parametrizationOf(const Disc& disc, double texels, int roughness, const Progress& progress) {
  Parametrization result;
  if (disc.border.size() > 3)
    result.coordinates = CornerSearch(disc, roughness).run();
  else
    result.coordinates = ConvexMap(disc, weightsFor(roughness))(triangleInSquare(disc));
  if (roughness == 0)
    lowerStretch(disc, result.coordinates, {.clearance = kGapTexels / std::sqrt(texels)}, progress);
  result.stretch = stretchSums(disc.positions, disc.triangles, result.coordinates);
  return result;
}

} // namespace surflect::slf
