// Percentiles of streams of values.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::image {

// Histogram of positive values by their leading 20 bits: percentiles to a relative error of 2^-12, in 8 MiB.
class PercentileCounter {
public:
  // Negative values and NaN count as 0.
  void add(float value) {
    ++total_;
    if (value > 0) ++bins_[std::bit_cast<uint32_t>(value) >> kDropped];
  }
  uint64_t count() const { return total_; }

  // Value below which this share of all values lies; 0 if it is not positive.
  double percentile(double share) const {
    auto above = static_cast<uint64_t>((1 - share) * static_cast<double>(total_));
    for (size_t bin = bins_.size(); bin-- > 0; above -= bins_[bin])
      if (bins_[bin] > above)
        return static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(bin) << kDropped));
    return 0;
  }

private:
  static constexpr int kDropped = 11; // low bits of 31
  std::vector<uint64_t> bins_ = std::vector<uint64_t>(size_t{1} << 20);
  uint64_t total_ = 0;
};

} // namespace surflect::image
