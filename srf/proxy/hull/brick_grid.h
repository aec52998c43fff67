// Sparse scalar field on the corners of a regular grid, stored near its sign changes.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/time.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace surflect::hull {

struct GridShape {
  Vec3<double> origin = Vec3<double>::Zero(); // position of corner (0, 0, 0), acquisition space
  double voxel = 1;                           // scene units
  std::array<int, 3> bricks{};                // number of bricks of 8 x 8 x 8 corners

  Point3<AcquisitionSpace, double> corner(int x, int y, int z) const {
    return assume<Point3<AcquisitionSpace, double>>(origin + voxel * Vec3<double>(x, y, z));
  }
};

// Values are scene units, positive inside, clamped to +-2 voxels. The border of the grid and everything
// beyond is outside.
class BrickGrid {
public:
  static constexpr int kSide = 8;
  using Corner = std::array<int, 3>;

  // `regionOf` tells whether the field is known to have one sign in a ball; `valueAt` is the field. Both are
  // called from many threads.
  BrickGrid(const GridShape& shape, const std::function<Region(const Ball&)>& regionOf,
            const std::function<double(const Point3<AcquisitionSpace, double>&)>& valueAt,
            const Progress& progress);

  const GridShape& shape() const { return shape_; }
  double limit() const { return 2 * shape_.voxel; }

  float at(const Corner& corner) const;
  void set(const Corner& corner, float value); // corner not on the border

  size_t brickCount() const { return directory_.size(); }
  Corner firstCorner(size_t brick) const;
  size_t brickOf(const Corner& corner) const; // corner in the grid
  bool contains(const Corner& corner) const;
  // Returns whether a cell that starts in this brick may be crossed by the surface.
  bool mayHaveSurface(size_t brick) const;

private:
  using Values = std::array<float, kSide * kSide * kSide>;
  static constexpr int32_t kOutside = -1, kInside = -2;

  static size_t indexInBrick(const Corner& corner);
  bool onBorder(const Corner& corner) const;
  float constant(int32_t state) const;
  void keepApart();

  GridShape shape_;
  std::vector<int32_t> directory_; // per brick: an index into values_, or the brick's uniform sign
  std::vector<Values> values_;
};

} // namespace surflect::hull
