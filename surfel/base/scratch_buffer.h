// Uninitialised memory that is kept for reuse, because fresh pages cost more than filling them.
#pragma once

#include <cstddef>
#include <memory>

namespace surflect {

// Storage for values without initialisation. Not copied.
template <class T> class ScratchBuffer {
public:
  // Returns space for at least `count` values. Reallocates, without keeping values, if the space is too small
  // or more than four times too large.
  T* of(size_t count) {
    constexpr size_t kLittle = 1024; // bytes that are always kept
    const bool isWaste = capacity_ / 4 > count && capacity_ * sizeof(T) > kLittle;
    if (count > capacity_ || isWaste || !values_) { // values_ is null after a move
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
