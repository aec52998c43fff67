// Closest views of a vertex for a viewing direction, with their weights.
//
// [Vlasic 2003] Vlasic et al.: Opacity Light Fields, I3D.   [Buehler 2001] as in srf/weights/ulr.h.
// Symbols: C_i direction towards view i, d towards the viewer; p_i = 1 - cos(C_i, d) penalty, r_i relevance,
// w_i weight.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::olf {

struct WeightedView {
  uint32_t view = 0;
  double weight = 0; // not negative
};

// At most three views; their weights sum to one unless there is none.
class ClosestViews {
public:
  static constexpr size_t kMost = 3;

  void push(WeightedView view) {
    assert(count_ < kMost);
    views_[count_++] = view;
  }
  size_t size() const { return count_; }
  const WeightedView* begin() const { return views_.data(); }
  const WeightedView* end() const { return views_.data() + count_; }
  WeightedView* begin() { return views_.data(); }
  WeightedView* end() { return views_.data() + count_; }

private:
  std::array<WeightedView, kMost> views_;
  size_t count_ = 0;
};

// Blends the three views of least penalty by r_i = (cos_i - cos_k) / (1 - cos_i), where k = 4 is the next
// one; with three views k = 3, so that two are blended; with fewer all, with cos_k = 0.
// [Vlasic 2003, §5.1, Eqs. 1-4]  r is clamped at 0; if all are 0 the nearest view has the weight 1. The view
// of a penalty is its index; views of equal penalties keep their order.
ClosestViews ulrViews(std::span<const double> penalties);

} // namespace surflect::olf
