#include "srf/proxy/hull/brick_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::hull {

BrickGrid::BrickGrid(const GridShape& shape, const std::function<Region(const Ball&)>& regionOf,
                     const std::function<double(const Point3<AcquisitionSpace, double>&)>& valueAt,
                     const Progress& progress)
    : shape_(shape) {
  const auto& [bx, by, bz] = shape.bricks;
  directory_.resize(static_cast<size_t>(bx) * static_cast<size_t>(by) * static_cast<size_t>(bz));

  // A brick owns its corners and the cells around them, which start one corner earlier.
  const double half = (kSide + 1) / 2.0 * shape.voxel;
  constexpr int32_t kMixed = 0;
  tbb::parallel_for(size_t{0}, directory_.size(), [&](size_t brick) {
    progress.checkpoint();
    const auto [x, y, z] = firstCorner(brick);
    const Vec3<double> center = shape.corner(x - 1, y - 1, z - 1).raw().array() + half;
    const Region region = regionOf({assume<Point3<AcquisitionSpace, double>>(center), std::sqrt(3.0) * half});
    const bool onBorder =
        x == 0 || y == 0 || z == 0 || x / kSide == bx - 1 || y / kSide == by - 1 || z / kSide == bz - 1;
    directory_[brick] = region == Region::outside               ? kOutside
                        : region == Region::inside && !onBorder ? kInside
                                                                : kMixed;
  });
  keepApart();

  std::vector<size_t> mixed;
  for (size_t brick = 0; brick < directory_.size(); ++brick)
    if (directory_[brick] >= 0) {
      directory_[brick] = static_cast<int32_t>(mixed.size());
      mixed.push_back(brick);
    }
  values_.resize(mixed.size());
  tbb::parallel_for(size_t{0}, mixed.size(), [&](size_t i) {
    progress.checkpoint();
    const auto [x0, y0, z0] = firstCorner(mixed[i]);
    for (int z = z0; z < z0 + kSide; ++z)
      for (int y = y0; y < y0 + kSide; ++y)
        for (int x = x0; x < x0 + kSide; ++x)
          values_[i][indexInBrick({x, y, z})] =
              onBorder({x, y, z})
                  ? constant(kOutside)
                  : static_cast<float>(std::clamp(valueAt(shape.corner(x, y, z)), -limit(), limit()));
  });
}

// Adjacent bricks of opposite sign were classified wrongly: evaluate the field between them.
void BrickGrid::keepApart() {
  const std::vector<int32_t> judged = directory_;
  for (size_t brick = 0; brick < judged.size(); ++brick) {
    if (judged[brick] != kInside) continue;
    const Corner first = firstCorner(brick);
    for (int n = 0; n < 27; ++n) {
      const Corner other{first[0] + kSide * (n % 3 - 1), first[1] + kSide * (n / 3 % 3 - 1),
                         first[2] + kSide * (n / 9 - 1)};
      if (!contains(other) || judged[brickOf(other)] != kOutside) continue;
      directory_[brick] = directory_[brickOf(other)] = 0;
    }
  }
}

float BrickGrid::constant(int32_t state) const {
  return static_cast<float>(state == kInside ? limit() : -limit());
}

BrickGrid::Corner BrickGrid::firstCorner(size_t brick) const {
  const auto bx = static_cast<size_t>(shape_.bricks[0]), by = static_cast<size_t>(shape_.bricks[1]);
  return {static_cast<int>(brick % bx) * kSide, static_cast<int>(brick / bx % by) * kSide,
          static_cast<int>(brick / bx / by) * kSide};
}

size_t BrickGrid::brickOf(const Corner& corner) const {
  return (static_cast<size_t>(corner[2] / kSide) * static_cast<size_t>(shape_.bricks[1]) +
          static_cast<size_t>(corner[1] / kSide)) *
             static_cast<size_t>(shape_.bricks[0]) +
         static_cast<size_t>(corner[0] / kSide);
}

size_t BrickGrid::indexInBrick(const Corner& corner) {
  return static_cast<size_t>((corner[2] % kSide * kSide + corner[1] % kSide) * kSide + corner[0] % kSide);
}

bool BrickGrid::contains(const Corner& corner) const {
  for (size_t axis = 0; axis < 3; ++axis)
    if (corner[axis] < 0 || corner[axis] >= kSide * shape_.bricks[axis]) return false;
  return true;
}

bool BrickGrid::onBorder(const Corner& corner) const {
  for (size_t axis = 0; axis < 3; ++axis)
    if (corner[axis] <= 0 || corner[axis] >= kSide * shape_.bricks[axis] - 1) return true;
  return false;
}

float BrickGrid::at(const Corner& corner) const {
  if (!contains(corner)) return constant(kOutside);
  const int32_t state = directory_[brickOf(corner)];
  return state < 0 ? constant(state) : values_[static_cast<size_t>(state)][indexInBrick(corner)];
}

void BrickGrid::set(const Corner& corner, float value) {
  assert(!onBorder(corner));
  int32_t& state = directory_[brickOf(corner)];
  if (state < 0) {
    values_.emplace_back().fill(constant(state));
    state = static_cast<int32_t>(values_.size() - 1);
  }
  values_[static_cast<size_t>(state)][indexInBrick(corner)] = value;
}

bool BrickGrid::mayHaveSurface(size_t brick) const {
  const Corner first = firstCorner(brick);
  const int32_t state = directory_[brick];
  if (state >= 0) return true;
  for (int n = 1; n < 8; ++n) {
    const Corner other{first[0] + kSide * (n & 1), first[1] + kSide * (n >> 1 & 1),
                       first[2] + kSide * (n >> 2)};
    if (contains(other) && directory_[brickOf(other)] != state) return true;
  }
  return false;
}

} // namespace surflect::hull
