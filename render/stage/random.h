// Random numbers that depend on nothing but what they are for, so that pictures have the same bits whatever
// thread makes which pixel.
//
// [Knuth 1997] The Art of Computer Programming 2: Seminumerical Algorithms, 3rd ed.
// [Steele 2014] Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <utility>
#include <vector>

namespace surflect::stage {

// SplitMix64.  [Steele 2014]
class Random {
public:
  // A stream of its own for each list of keys.
  explicit Random(std::initializer_list<uint64_t> keys) {
    for (const uint64_t key : keys) state_ = mixed(state_ + kStep) ^ mixed(key + kStep);
  }

  // In [0, 1).
  double next() { return static_cast<double>(mixed(state_ += kStep) >> 11) * 0x1p-53; }

private:
  static constexpr uint64_t kStep = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio

  static uint64_t mixed(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }

  uint64_t state_ = 0;
};

// Cells of a grid over the unit square, as many as there are samples: sets of samples with one in each cell
// are spread evenly. Several such sets take their cells in orders of their own.
class Strata {
public:
  // As square as the number of cells, above 0, lets the grid be.
  explicit Strata(uint32_t cells) : rows_(static_cast<uint32_t>(std::sqrt(cells))) {
    while (cells % rows_ != 0) --rows_;
    columns_ = cells / rows_;
  }

  // All orders of the cells are as likely.  [Knuth 1997, §3.4.2, algorithm P]
  std::vector<uint32_t> shuffled(Random& random) const {
    std::vector<uint32_t> cells(columns_ * rows_);
    std::iota(cells.begin(), cells.end(), 0u);
    for (size_t i = cells.size(); i > 1; --i)
      std::swap(cells[i - 1], cells[static_cast<size_t>(random.next() * static_cast<double>(i))]);
    return cells;
  }

  // Somewhere in a cell.
  std::pair<double, double> in(uint32_t cell, Random& random) const {
    const double u = (cell % columns_ + random.next()) / columns_;
    const double v = (cell / columns_ + random.next()) / rows_;
    return {u, v};
  }

private:
  uint32_t columns_, rows_;
};

} // namespace surflect::stage
