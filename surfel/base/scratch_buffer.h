// Memory that is written before it is read, and kept for the next time: fresh pages cost more than to fill
// them.
#pragma once

#include <cstddef>
#include <memory>

namespace surflect {

// Room for values without their first ones. Not copied.
template <class T> class ScratchBuffer {
public:
  // For at least `count` values. Where there is not enough, or more than four times as much, it is had anew,
  // and those in it are lost.
  T* of(size_t count) {
    constexpr size_t kLittle = 1024; // bytes that may stay
    const bool isWaste = capacity_ / 4 > count && capacity_ * sizeof(T) > kLittle;
    if (count > capacity_ || isWaste || !values_) { // none once it has been moved away
      values_.reset();
      values_ = std::make_unique_for_overwrite<T[]>(count);
      capacity_ = count;
    }
    return values_.get();
  }
  T* data() { return values_.get(); }
  const T* data() const { return values_.get(); }

private:
  std::unique_ptr<T[]> values_;
  size_t capacity_ = 0;
};

} // namespace surflect
