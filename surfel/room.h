// Memory that is written before it is read, and kept for the next time: fresh pages cost more than to fill
// them.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

namespace surflect {

// Room for values without their first ones. Not copied.
template <class T> class Room {
public:
  // For at least `count` values; where that is more than ever before, those in it are lost.
  T* of(size_t count) {
    if (count > capacity_ || !values_) { // none once it has been moved away
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
