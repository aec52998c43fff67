// Random numbers keyed by their purpose, so that pictures have the same bits for any assignment of pixels to
// threads.
//
// [Knuth 1997] The Art of Computer Programming 2: Seminumerical Algorithms, 3rd ed. [Steele 2014] Steele,
// Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <utility>
#include <vector>

namespace surflect::stage {

// SplitMix64 generator.  [Steele 2014]
class Random {
public:
  // An independent stream for each list of keys.
  explicit Random(std::initializer_list<uint64_t> keys) {
    for (const uint64_t key : keys) state_ = mixed(state_ + kStep) ^ mixed(key + kStep);
  }

  // Uniform number in [0, 1).
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

// Stratified samples of the unit square: one sample per cell of a grid. Several sets of samples use
// independent orders of the cells.
class Strata {
public:
  // Grid as square as the number of cells, above 0, allows.
  explicit Strata(uint32_t cells) : rows_(static_cast<uint32_t>(std::sqrt(cells))) {
    while (cells % rows_ != 0) --rows_;
    columns_ = cells / rows_;
  }

  // Random permutation of the cells, all equally likely.  [Knuth 1997, §3.4.2, algorithm P]
  std::vector<uint32_t> shuffled(Random& random) const {
    std::vector<uint32_t> cells(columns_ * rows_);
    std::iota(cells.begin(), cells.end(), 0u);
    for (size_t i = cells.size(); i > 1; --i)
      std::swap(cells[i - 1], cells[static_cast<size_t>(random.next() * static_cast<double>(i))]);
    return cells;
  }

  // Uniform point in a cell.
  std::pair<double, double> in(uint32_t cell, Random& random) const {
    const double u = (cell % columns_ + random.next()) / columns_;
    const double v = (cell / columns_ + random.next()) / rows_;
    return {u, v};
  }

private:
  uint32_t columns_, rows_;
};

} // namespace surflect::stage
